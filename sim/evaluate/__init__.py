"""Figures of merit of a flight, from its trace and the truth."""
