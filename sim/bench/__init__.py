"""Benches: what a tick and a picture cost, beside their rivals, as ratios within one run."""
