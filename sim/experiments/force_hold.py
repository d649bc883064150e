"""Force holding: 5 N on walls of three stiffnesses, with and without impedance, and where direct control oscillates."""

from __future__ import annotations

import dataclasses

from ibvs_qp.pilot import PilotConfig
from sim.evaluate.measures import press_figures
from sim.experiments.base import Choice, Column, Criterion, Experiment, runs
from sim.experiments.figures.force_hold import draw_force_hold
from sim.experiments.scenes import near_wall
from sim.flight.jobs import PressJob
from sim.sweep.design import Run

NAME = "force-hold"
#: Hold of the main flights and of the map's [s].
HOLD_S, MAP_HOLD_S = 9.0, 6.0
STIFFNESS_N_M = (1500.0, 5000.0, 10000.0)
#: The map: factor on K_fp and K_fi, wall stiffness [N/m], delay of the force/torque sensor [s].
MAP_GAINS, MAP_STIFFNESS, MAP_DELAYS = (1.0, 2.0, 3.0, 5.0), (1500.0, 3000.0, 6000.0, 10000.0), (0.004, 0.024, 0.048)


def with_force_gain(config: PilotConfig, factor: float) -> PilotConfig:
    """The pilot with K_fp and K_fi multiplied."""
    gains = config.controller.gains
    gains = dataclasses.replace(gains, force_kfp=factor * gains.force_kfp, force_kfi=factor * gains.force_kfi)
    return dataclasses.replace(config, controller=dataclasses.replace(config.controller, gains=gains))


def design(choice: Choice) -> list[Run]:
    """Three walls with and without impedance, then the map."""
    flights = []
    for stiffness in STIFFNESS_N_M[:: 2 if choice.quick else 1]:
        for variant in ("standard",) if choice.quick and stiffness != STIFFNESS_N_M[0] else ("standard", "direct"):
            flights += runs(
                NAME,
                choice,
                scene=near_wall(wall={"stiffness_n_m": stiffness}),
                job=PressJob(hold_s=HOLD_S),
                measure=press_figures,
                variant=variant,
                params={"kind": "hold", "stiffness_n_m": stiffness, "force_gain": 1.0, "delay_s": 0.004},
                seeds=1 if choice.quick else 8,
            )
    return flights + _map(choice)


def _map(choice: Choice) -> list[Run]:
    gains, walls, delays = MAP_GAINS, MAP_STIFFNESS, MAP_DELAYS
    if choice.quick:
        gains, walls, delays = gains[:3], walls[:1], delays[1:2]
    flights = []
    for delay in delays:
        for stiffness in walls:
            for factor in gains:
                for variant in ("standard", "direct"):
                    flights += runs(
                        NAME,
                        choice,
                        scene=near_wall(wall={"stiffness_n_m": stiffness}, force_torque={"latency_s": delay}),
                        job=PressJob(hold_s=MAP_HOLD_S),
                        measure=press_figures,
                        variant=variant,
                        laws=("qp",) if choice.quick else ("qp", "paper"),
                        params={"kind": "map", "stiffness_n_m": stiffness, "force_gain": factor, "delay_s": delay},
                        seeds=1,
                        change=lambda config, factor=factor: with_force_gain(config, factor),
                        features="geometric",
                        keep=False,
                    )
    return flights


_HOLD = {"kind": "hold"}
EXPERIMENT = Experiment(
    name=NAME,
    title="Force holding with and without impedance",
    about="Approach, touch and hold 5 N for 9 s on walls of 1.5, 5 and 10 kN/m. The map multiplies the force gains "
    "and delays the force/torque sensor on geometric features, to find where direct force control oscillates.",
    paper="5 N hold. On the clock of its plot, contact at about 20 s and the way to the reference from 20 to 30 s: "
    "about 10 s after touch. Settling here counts from first touch too, first touch from the start of the flight. "
    "Direct force control oscillates and crashed on hardware. No error figure is printed. Best published real flight "
    "of this class: 0.7 N rms.",
    design=design,
    params={
        "kind": "flights",
        "stiffness_n_m": "wall [N/m]",
        "force_gain": "force gain [×]",
        "delay_s": "F/T delay [s]",
    },
    columns=(
        Column(metric="first_touch_s", label="first touch after the start", unit="s", digits=1, better=0),
        Column(metric="settle_s", label="settled after touch", unit="s"),
        Column(metric="touch_peak_n", label="peak at touch", unit="N"),
        Column(metric="bounces", label="bounces", digits=0),
        Column(metric="force_rms_n", label="push error, steady rms", unit="N", digits=3),
        Column(metric="contact_share", label="contact, steady", unit="%", scale=100.0, digits=1, better=1),
        Column(metric="tilt_rms_deg", label="tilt, rms", unit="deg"),
    ),
    criteria=(
        Criterion(text="within ±0.5 N after first touch", metric="settle_s", bound=1.5, params=_HOLD, unit="s"),
        Criterion(text="peak", metric="touch_peak_n", bound=6.5, params=_HOLD, unit="N", every=True),
        Criterion(text="bounces", metric="bounces", bound=1.0, params=_HOLD, every=True),
        Criterion(text="steady push error, rms", metric="force_rms_n", bound=0.15, params=_HOLD, unit="N"),
        Criterion(text="tilt, rms", metric="tilt_rms_deg", bound=0.5, params=_HOLD, unit="deg"),
    ),
    draw=draw_force_hold,
    folded={"kind": "map"},
)
