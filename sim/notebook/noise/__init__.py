"""For 06_noise_sweep: the table of a noise sweep, what it says, and flights of it flown again."""
