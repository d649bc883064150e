"""Vehicles of others: read from their files, checked, and drawn at random."""
