"""Painting strategy: references for the controller from what the pilot estimates, phase by phase."""
