"""Friction: a slide at 0.1 m/s while the board holds the tip back, 0.7 m ahead of the centre of mass."""

from __future__ import annotations

from sim.evaluate.measures import slide_figures
from sim.experiments.base import Choice, Column, Criterion, Experiment, runs
from sim.experiments.figures.curves import Panel, curves
from sim.experiments.scenes import near_wall
from sim.flight.jobs import PressJob
from sim.sweep.design import Run

NAME = "friction"
FRICTION, QUICK = (0.1, 0.2, 0.3, 0.4, 0.6, 0.8), (0.8,)
HOLD_S, SLIDE_S = 3.0, 7.0


def design(choice: Choice) -> list[Run]:
    """Slides over friction, with and without feed-forward."""
    flights = []
    for variant in ("standard", "no-feedforward"):
        for friction in QUICK if choice.quick else FRICTION:
            flights += runs(
                NAME,
                choice,
                scene=near_wall(wall={"friction": friction}),
                job=PressJob(hold_s=HOLD_S, slide_s=SLIDE_S),
                measure=slide_figures,
                variant=variant,
                params={"friction": friction},
                seeds=1 if choice.quick else (4 if variant == "standard" else 2),
            )
    return flights


EXPERIMENT = Experiment(
    name=NAME,
    title="Sliding against friction",
    about="Press 5 N for 3 s, then slide at 0.1 m/s for 7 s along the bottom edge. Speed and yaw count from 1 s of "
    "sliding on, the yaw's peak from the start of the slide.",
    paper="Coulomb friction was added to the simulator because it 'significantly affects' the flight; no figure.",
    design=design,
    params={"friction": "friction"},
    columns=(
        Column(metric="yaw_rms_deg", label="yaw, rms", unit="deg"),
        Column(metric="yaw_peak_deg", label="yaw, peak", unit="deg"),
        Column(metric="speed_error_share", label="speed error", unit="%", scale=100.0, digits=1),
        Column(metric="path_rms_m", label="height error, rms", unit="mm", scale=1e3),
        Column(metric="force_rms_n", label="push error, rms", unit="N", digits=3),
        Column(metric="contact_share", label="contact", unit="%", scale=100.0, digits=1, better=1),
    ),
    criteria=(
        Criterion(text="yaw after 1 s, rms", metric="yaw_rms_deg", bound=1.0, unit="deg"),
        Criterion(text="yaw, peak", metric="yaw_peak_deg", bound=3.0, unit="deg", every=True),
        Criterion(text="speed error", metric="speed_error_share", bound=0.05, scale=100.0, unit="%"),
    ),
    draw=curves(
        "friction",
        "Yaw, speed and height while sliding, over friction",
        "friction",
        "friction coefficient",
        (
            Panel(metric="yaw_rms_deg", label="yaw, rms [deg]"),
            Panel(metric="speed_error_share", label="speed error [%]", scale=100.0),
            Panel(metric="path_rms_m", label="height error, rms [mm]", scale=1e3),
        ),
    ),
)
