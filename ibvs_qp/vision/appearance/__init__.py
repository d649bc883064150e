"""Appearance of board and paint, in the light that falls on them."""
