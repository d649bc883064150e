"""Painting strategy: references for the controller from the estimates, phase by phase."""
