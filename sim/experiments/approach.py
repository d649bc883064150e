"""Approach and touch: how hard the first touch is on walls of every stiffness, with and without the ramp."""

from __future__ import annotations

from sim.evaluate.measures import press_figures
from sim.experiments.base import Choice, Column, Criterion, Experiment, runs
from sim.experiments.figures.curves import Panel, curves
from sim.experiments.scenes import changed
from sim.flight.jobs import PressJob
from sim.sweep.design import Run
from sim.world.scene import Scene

NAME = "approach"
STIFFNESS_N_M, QUICK_N_M = (1000.0, 1500.0, 3000.0, 5000.0, 10000.0), (5000.0,)
HOLD_S = 5.0


def design(choice: Choice) -> list[Run]:
    """From the scene's usual start distance, with the ramp and without it."""
    flights = []
    for variant in ("standard", "no-ramp"):
        for stiffness in QUICK_N_M if choice.quick else STIFFNESS_N_M:
            flights += runs(
                NAME,
                choice,
                scene=changed(Scene(), wall={"stiffness_n_m": stiffness}),
                job=PressJob(hold_s=HOLD_S),
                measure=press_figures,
                variant=variant,
                params={"stiffness_n_m": stiffness},
                seeds=1 if choice.quick else 3,
            )
    return flights


EXPERIMENT = Experiment(
    name=NAME,
    title="Approach and first touch",
    about="From 0.45 m to a held push of 5 N on walls of 1 to 10 kN/m, with the ramp after touch and without it.",
    paper="Contact at about 20 s on the clock of its plot, whose start against the activation is not told; no peak is "
    "reported. First touch here counts from the start of the flight, which is when the law is activated.",
    design=design,
    params={"stiffness_n_m": "wall [N/m]"},
    columns=(
        Column(metric="first_touch_s", label="first touch after the start", unit="s", digits=1, better=0),
        Column(metric="approach_speed_m_s", label="speed at touch", unit="mm/s", scale=1e3, digits=0, better=0),
        Column(metric="touch_peak_n", label="peak", unit="N"),
        Column(metric="bounces", label="bounces", digits=0),
        Column(metric="settle_s", label="settled after touch", unit="s"),
    ),
    criteria=(
        Criterion(text="peak", metric="touch_peak_n", bound=6.5, unit="N", every=True),
        Criterion(text="bounces", metric="bounces", bound=1.0, every=True),
        Criterion(text="settled after touch", metric="settle_s", bound=1.5, unit="s"),
    ),
    draw=curves(
        "approach",
        "Peak, bounces and settling of the first touch over the wall's stiffness",
        "stiffness_n_m",
        "wall [N/m]",
        (
            Panel(metric="touch_peak_n", label="peak [N]"),
            Panel(metric="bounces", label="bounces"),
            Panel(metric="settle_s", label="settled after touch [s]"),
        ),
        variants=("standard", "no-ramp"),
    ),
)
