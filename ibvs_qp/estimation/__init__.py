"""Estimation: from late, noisy samples to what is true now."""
