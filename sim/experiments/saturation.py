"""Saturation: pushes up to and beyond the reach, standing still, sliding, and with derated rotors."""

from __future__ import annotations

import dataclasses

from ibvs_qp.pilot import PilotConfig
from sim.evaluate.measures import press_figures, slide_figures
from sim.experiments.base import Choice, Column, Criterion, Experiment, runs
from sim.experiments.figures.saturation import draw_saturation
from sim.experiments.scenes import near_wall
from sim.experiments.variants import VARIANTS
from sim.flight.jobs import PressJob
from sim.sweep.design import Run

NAME = "saturation"
#: Time of a static press, and of hold and slide of a sliding one [s].
PRESS_S, HOLD_S, SLIDE_S = 9.0, 3.0, 5.0
#: Asked pushes [N]: standing still, sliding, and with every rotor limited to `DERATED_N` [N] (reach 13.0 N).
STATIC_N, SLIDING_N, DERATED_PUSH_N = (15.0, 20.0, 25.0, 27.5, 30.0, 35.0), (5.0, 10.0, 15.0, 20.0), (10.0, 13.0, 20.0)
DERATED_N = 20.0
FRICTION, SLIPPERY = 0.3, 0.05
#: Friction and asked push [N] of the slides beyond reach.
BEYOND = ((0.3, 20.0), (0.8, 10.0), (0.8, 15.0), (0.8, 20.0))
#: Asked pushes of the program without rotor limits [N], its thrusts clipped afterwards.
CLIPPED_N = (20.0, 25.0, 27.5, 30.0, 35.0)


def with_thrust_max(config: PilotConfig, limit_n: float) -> PilotConfig:
    """A pilot that knows of lower upper thrust limits."""
    vehicle = dataclasses.replace(config.controller.vehicle, thrust_max_n=limit_n)
    return dataclasses.replace(config, controller=dataclasses.replace(config.controller, vehicle=vehicle))


def design(choice: Choice) -> list[Run]:
    """Static pushes with and without the reach check, then sliding, then derated."""
    seeds = 1 if choice.quick else 2
    flights = []
    cells = [("standard", FRICTION), ("no-reach-check", FRICTION), ("no-reach-check", SLIPPERY)]
    for variant, friction in [*cells, ("clipped", FRICTION)]:
        pushes = CLIPPED_N if variant == "clipped" else STATIC_N
        if choice.quick:
            pushes = (20.0, 35.0) if friction == FRICTION and variant == "standard" else (35.0,)
        for push in pushes:
            flights += runs(
                NAME,
                choice,
                scene=near_wall(paint={"push_n": push}, wall={"friction": friction}),
                job=PressJob(hold_s=PRESS_S),
                measure=press_figures,
                variant=variant,
                laws=VARIANTS[variant].laws,
                params={"kind": "static", "push_n": push, "friction": friction},
                seeds=seeds,
            )
    return flights + _sliding(choice, seeds) + _derated(choice, seeds)


def _sliding(choice: Choice, seeds: int) -> list[Run]:
    flights = []
    for friction in (0.8,) if choice.quick else (0.3, 0.8):
        for push in (15.0,) if choice.quick else SLIDING_N:
            flights += runs(
                NAME,
                choice,
                scene=near_wall(paint={"push_n": push}, wall={"friction": friction}),
                job=PressJob(hold_s=HOLD_S, slide_s=SLIDE_S),
                measure=slide_figures,
                params={"kind": "sliding", "push_n": push, "friction": friction},
                seeds=seeds,
            )
    return flights


def _derated(choice: Choice, seeds: int) -> list[Run]:
    flights = []
    for variant in ("standard",) if choice.quick else ("standard", "no-reach-check"):
        for push in (20.0,) if choice.quick else DERATED_PUSH_N:
            flights += runs(
                NAME,
                choice,
                scene=near_wall(paint={"push_n": push}, vehicle={"thrust_max_n": DERATED_N}),
                job=PressJob(hold_s=PRESS_S),
                measure=press_figures,
                variant=variant,
                params={"kind": "derated", "push_n": push, "friction": FRICTION},
                seeds=seeds,
                change=lambda config: with_thrust_max(config, DERATED_N),
            )
    return flights


def _asked(push: float) -> dict[str, float | str]:
    return {"kind": "static", "push_n": push}


EXPERIMENT = Experiment(
    name=NAME,
    title="Pushing to the limit of the rotors",
    about="Static pushes of 15 to 35 N (reach 30.4 N), with the reach check and without it (also at friction 0.05, "
    "where stiction holds nothing), with the program's thrusts clipped afterwards instead of limited within, sliding "
    "pushes up to the friction-aware limit, and pushes with every rotor limited to 20 N (reach 13.0 N). The reach is a "
    "linear program over the true limits.",
    paper="Not reported. Open loop, over 4000 random wrenches beyond reach: pseudo-inverse and clipping miss 17 N of "
    "lift rms, a box-constrained program 0.35 N.",
    design=design,
    params={"kind": "press", "push_n": "asked [N]", "friction": "friction"},
    columns=(
        Column(metric="push_mean_n", label="delivered", unit="N", better=0),
        Column(metric="force_error_rms_n", label="push minus asked, rms", unit="N"),
        Column(metric="reach_n", label="reach", unit="N", better=0),
        Column(metric="force_std_n", label="push, deviation", unit="N"),
        Column(metric="height_error_peak_m", label="height error, peak", unit="mm", scale=1e3, digits=1),
        Column(metric="tilt_rms_deg", label="tilt, rms", unit="deg"),
        Column(metric="tilt_peak_deg", label="tilt, peak", unit="deg"),
        Column(metric="yaw_peak_deg", label="yaw, peak", unit="deg"),
        Column(metric="limited_share", label="limited ticks", unit="%", scale=100.0, digits=0, better=0),
    ),
    criteria=(
        *(
            Criterion(
                text=f"{push:g} N: delivered over asked",
                metric="delivered_share",
                bound=0.95,
                least=True,
                params=_asked(push),
                scale=100.0,
                unit="%",
            )
            for push in STATIC_N[:-1]
        ),
        *(
            criterion
            for variant in ("standard", "no-reach-check")
            for criterion in (
                Criterion(
                    text="35 N: delivered over reach",
                    metric="reach_share",
                    bound=0.95,
                    least=True,
                    params=_asked(35.0),
                    variant=variant,
                    scale=100.0,
                    unit="%",
                ),
                Criterion(
                    text="35 N: height error, peak",
                    metric="height_error_peak_m",
                    bound=0.05,
                    params=_asked(35.0),
                    variant=variant,
                    scale=1e3,
                    unit="mm",
                    every=True,
                ),
                Criterion(
                    text="35 N: tilt, rms",
                    metric="tilt_rms_deg",
                    bound=1.0,
                    params=_asked(35.0),
                    variant=variant,
                    unit="deg",
                ),
                Criterion(
                    text="35 N: tilt, peak",
                    metric="tilt_peak_deg",
                    bound=2.0,
                    params=_asked(35.0),
                    variant=variant,
                    unit="deg",
                    every=True,
                ),
            )
        ),
        *(
            criterion
            for friction, push in BEYOND
            for cell in ({"kind": "sliding", "push_n": push, "friction": friction},)
            for criterion in (
                Criterion(
                    text=f"sliding at friction {friction:g}, {push:g} N: push over reach",
                    metric="reach_share",
                    bound=1.0,
                    params=cell,
                    scale=100.0,
                    unit="%",
                    every=True,
                ),
                Criterion(
                    text=f"sliding at friction {friction:g}, {push:g} N: reduced with the reason",
                    metric="reduced_said",
                    bound=1.0,
                    least=True,
                    params=cell,
                    every=True,
                ),
                Criterion(
                    text=f"sliding at friction {friction:g}, {push:g} N: yaw held, peak",
                    metric="yaw_peak_deg",
                    bound=3.0,
                    params=cell,
                    unit="deg",
                    every=True,
                ),
                Criterion(
                    text=f"sliding at friction {friction:g}, {push:g} N: completed",
                    metric="completed",
                    bound=1.0,
                    least=True,
                    params=cell,
                    failed_too=True,
                    every=True,
                ),
            )
        ),
        Criterion(
            text="derated to 20 N, 20 N asked: delivered over reach",
            metric="reach_share",
            bound=0.95,
            least=True,
            params={"kind": "derated", "push_n": 20.0},
            scale=100.0,
            unit="%",
        ),
    ),
    draw=draw_saturation,
)
