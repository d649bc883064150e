"""Flights: short paint jobs on random scenes in a trial, and four harder scenes before the choice of a preset."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Any

from ibvs_qp.pilot import PilotConfig
from sim.evaluate.measures import paint_figures
from sim.experiments.preset_flights import paint_runs
from sim.experiments.scenes import NEAR_START_M, changed
from sim.sweep.design import Run
from sim.vehicles.configuration import with_camera
from sim.world.random_scene import TUNING, random_scene
from sim.world.scene import Scene
from sim.world.worlds import in_world

#: Length of a row in the search [m]: touch, both corners, a climb and 6 s of straights in about 18 s of flight.
STROKE_M = 0.3
#: Random scenes that every trial flies; finalists fly the next four as well.
SEARCH_SCENES = 3
#: World of every scene: the gains are for a well-built vehicle, not for one without errors.
WORLD = "datasheet"
#: First seed of the search, of the choice among its best, and of the report; no other experiment flies them.
SEARCH_SEED, CHOICE_SEED, REPORT_SEED = 1000, 2000, 3000
#: Seeds between those of one scene and of the next: every scene draws other errors.
SEED_STRIDE = 100
#: Starts, approaches and retreats beside the strokes [s]; sizes the progress bar only.
_OVERHEAD_S = 9.0


@functools.cache
def scenes() -> dict[str, Scene]:
    """Scenes of the search: random ones of the tuning family, with short rows."""
    return {f"random {number}": in_world(_short(number), WORLD) for number in range(SEARCH_SCENES)}


@functools.cache
def checks() -> dict[str, Scene]:
    """Further scenes of finalists: the whole job, a neglected vehicle, a wall to which the tip sticks, strong gusts."""
    job, neglected, sticking, gusts = range(SEARCH_SCENES, SEARCH_SCENES + 4)
    return {
        "whole job": in_world(random_scene(job, TUNING), WORLD),
        "harsh": in_world(_short(neglected), "harsh"),
        "sticking": in_world(changed(_short(sticking), wall={"friction": 0.8}), WORLD),
        "gusts": in_world(changed(_short(gusts), wind={"gust_n_rms": 2.0}), WORLD),
    }


def _short(number: int) -> Scene:
    """A scene of the tuning family that starts near the wall and has short rows."""
    scene = random_scene(number, TUNING)
    return changed(scene, paint={"stroke_m": STROKE_M}, start={"distance_m": NEAR_START_M})


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
    return [
        run
        for place, (name, scene) in enumerate(flown.items())
        for run in paint_runs(
            with_camera(scene, config.controller.vehicle),
            config,
            tuple(seed + SEED_STRIDE * place for seed in seeds),
            features,
            params={"scene": name},
            **cell,
        )
    ]


def seeds(first: int, seed: int, count: int) -> range:
    """Seeds of one purpose; searches with different seeds have different ones."""
    return range(first + 10_000 * seed, first + 10_000 * seed + count)
