"""Figures of the experiments, drawn from tables and kept logs alone."""
