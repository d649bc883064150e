"""Benchmarks: processor time of a tick and of a picture, and ratios to rivals within one run."""
