"""Figures of a sweep, drawn from its table alone: boxes, heat maps, success-rate maps, rank correlations."""

from sim.sweep.figures.page import write_report

__all__ = ["write_report"]
