"""Estimation of the present state from late, noisy samples."""
