"""Flights: short paint jobs on three scenes in a trial, and three harder scenes before the choice of a preset."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ibvs_qp.pilot import PilotConfig
from sim.evaluate.measures import paint_figures
from sim.experiments.preset_flights import paint_runs
from sim.experiments.scenes import changed, near_wall, short_job
from sim.sweep.design import Run
from sim.world.scene import Scene

#: Length of a row [m]: touch, both corners and a climb in about 17 s of flight.
STROKE_M = 0.2
#: First seed of the search, of the choice among its best, and of the report; no other experiment flies them.
SEARCH_SEED, CHOICE_SEED, REPORT_SEED = 1000, 2000, 3000
#: Starts, approaches and retreats beside the strokes [s]; sizes the progress bar only.
_OVERHEAD_S = 9.0


def scenes() -> dict[str, Scene]:
    """The nominal scene, a hard wall under a heavy vehicle, and noise with gusts."""
    nominal = short_job(STROKE_M)
    return {
        "nominal": nominal,
        "hard": changed(
            nominal,
            wall={"friction": 0.6, "stiffness_n_m": 4000.0},
            plant={"mass_kg": 6.5},
            force_torque={"sigma_n": 0.4},
        ),
        "rough": changed(nominal, features={"sigma_vs": 0.01}, wind={"gust_n_rms": 1.0}, plant={"mass_kg": 5.6}),
    }


def checks() -> dict[str, Scene]:
    """Further scenes of finalists: the whole job, a wall to which the tip sticks, strong gusts."""
    nominal = short_job(STROKE_M)
    return {
        "job": near_wall(),
        "sticking": changed(nominal, wall={"friction": 0.8}),
        "gusts": changed(nominal, wind={"gust_n_rms": 2.0}),
    }


def flights(
    flown: Mapping[str, Scene], config: PilotConfig, variant: str, seeds: Iterable[int], features: str
) -> list[Run]:
    """Every scene with every seed under a preset.

    Args:
        flown: Scenes by name.
        config: The preset, with its law.
        variant: Name of the preset in the table.
        seeds: Seeds.
        features: "geometric" or "rendered".
    """
    cell: dict[str, Any] = {
        "experiment": "tune",
        "variant": variant,
        "measure": paint_figures,
        "overhead_s": _OVERHEAD_S,
    }
    every = tuple(seeds)
    return [
        run
        for name, scene in flown.items()
        for run in paint_runs(scene, config, every, features, params={"scene": name}, **cell)
    ]


def seeds(first: int, seed: int, count: int) -> range:
    """Seeds of one purpose; searches with different seeds have different ones."""
    return range(first + 10_000 * seed, first + 10_000 * seed + count)
