"""Sloped edge: the board turned in its own plane; the path must follow the edge, the vehicle must not roll with it."""

from __future__ import annotations

from sim.evaluate.measures import paint_figures
from sim.experiments.base import Choice, Column, Criterion, Experiment, runs
from sim.experiments.figures.curves import Panel, curves
from sim.experiments.scenes import short_job
from sim.sweep.design import Run

NAME = "sloped-edge"
SLOPES_DEG, QUICK_DEG = (-5.0, -3.0, 1.0, 2.0, 3.0, 4.0, 5.0), (5.0,)
STROKE_M = 0.5


def design(choice: Choice) -> list[Run]:
    """One row along a sloped edge."""
    flights = []
    for slope in QUICK_DEG if choice.quick else SLOPES_DEG:
        flights += runs(
            NAME,
            choice,
            scene=short_job(STROKE_M, rows=1, board={"slope_deg": slope}),
            measure=paint_figures,
            params={"slope_deg": slope},
            seeds=1 if choice.quick else 3,
        )
    return flights


EXPERIMENT = Experiment(
    name=NAME,
    title="A sloped edge",
    about="One row of 0.5 m along the bottom edge of a board turned by up to 5 deg. The zero-tilt bound of the QP is "
    "1 deg; the analytic law rolls with the edge, as its angle rows ask.",
    paper="Not reported.",
    design=design,
    params={"slope_deg": "slope [deg]"},
    columns=(
        Column(metric="path_rms_m", label="path, rms", unit="mm", scale=1e3),
        Column(metric="tilt_rms_deg", label="tilt, rms", unit="deg"),
        Column(metric="tilt_peak_deg", label="tilt, peak", unit="deg"),
        Column(metric="force_rms_n", label="push error, rms", unit="N", digits=3),
    ),
    criteria=(
        Criterion(text="tilt, rms, within the bound", metric="tilt_rms_deg", bound=1.0, unit="deg"),
        Criterion(text="tilt, peak, within the bound", metric="tilt_peak_deg", bound=1.0, unit="deg", every=True),
        Criterion(text="path along the edge, rms", metric="path_rms_m", bound=0.005, scale=1e3, unit="mm"),
        Criterion(text="completed", metric="completed", bound=1.0, least=True, failed_too=True, every=True),
    ),
    draw=curves(
        "sloped-edge",
        "Tilt and path error over the slope of the edge",
        "slope_deg",
        "slope of the edge [deg]",
        (
            Panel(metric="tilt_rms_deg", label="tilt, rms [deg]"),
            Panel(metric="tilt_peak_deg", label="tilt, peak [deg]"),
            Panel(metric="path_rms_m", label="path error, rms [mm]", scale=1e3),
        ),
    ),
)
