"""Imports every module of kernels, so that `prepare` finds them."""

from ibvs_qp.vision.kernels import (
    borders,
    colors,
    fit_lines,
    flow,
    flow_points,
    hypotheses,
    labels,
    plane,
    registration,
    samples,
    segments,
)

__all__ = [
    "borders",
    "colors",
    "fit_lines",
    "flow",
    "flow_points",
    "hypotheses",
    "labels",
    "plane",
    "registration",
    "samples",
    "segments",
]
