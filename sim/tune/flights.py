"""Flights: short jobs on random scenes in a trial, and four harder ones before the choice of a preset."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from allocation import push_reach
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from ibvs_qp.pilot import PilotConfig
from sim.evaluate.measures import paint_figures, slide_figures
from sim.experiments.preset_flights import paint_runs
from sim.experiments.scenes import NEAR_START_M, changed
from sim.flight.jobs import Job, PaintJob, PressJob
from sim.rivals import MPC
from sim.sweep.design import Run
from sim.tune.objectives import PAINT, SATURATED, SLIDE, TASK
from sim.tune.space import Subject
from sim.vehicles.configuration import with_camera
from sim.world.random_scene import TUNING, random_scene
from sim.world.scene import Scene
from sim.world.worlds import in_world

#: Length of a row in the search [m]: touch, both corners, a climb and 6 s of straights in about 18 s of flight.
STROKE_M = 0.3
#: World of every scene: the gains are for a well-built vehicle, not for one without errors.
WORLD = "datasheet"
#: First seed of the search, of the choice among its best, and of the report; no other experiment flies them.
SEARCH_SEED, CHOICE_SEED, REPORT_SEED = 1000, 2000, 3000
#: Seeds between those of one scene and of the next: every scene draws other errors.
SEED_STRIDE = 100
#: Force of the gusts, rms [N], and of the strong ones; slope of the sloping edge [deg].
GUST_N, STRONG_GUST_N, SLOPE_DEG = 2.0, 3.0, 5.0
#: Slide with the push reduced to the reach, and slide with the reach check off: friction of each, and push over the
#: reach of the rotors [-]. For the Tarot 10 N and 16 N; 20 N, at 1.27, three of four slides go less than half way.
STICKING, STICKING_PUSH = 0.8, 1.15
SLIPPERY, SATURATING_PUSH = 0.3, 1.03
#: Hold and slide [s].
SLIDING = PressJob(hold_s=2.0, slide_s=4.0)
#: Direction of the slide in B.
LEFT = np.array([0.0, -1.0, 0.0])
#: Starts, approaches and retreats in addition to the strokes [s]; sizes the progress bar only.
_OVERHEAD_S = 9.0


@dataclass(frozen=True)
class Training:
    """A job on a scene.

    Attributes:
        scene: The scene.
        task: Task, which decides on job and objectives. A saturated slide has no reach check.
        push: Push over the reach of the rotors at the scene's friction [-]; 0 for the scene's push.
    """

    scene: Scene
    task: str = PAINT
    push: float = 0.0

    @property
    def job(self) -> Job:
        """The job."""
        return PaintJob() if self.task == PAINT else SLIDING

    def config(self, config: PilotConfig) -> PilotConfig:
        """A preset for this job."""
        if self.task != SATURATED:
            return config
        return dataclasses.replace(config, controller=dataclasses.replace(config.controller, reach_check=False))

    def scene_for(self, vehicle: VehicleParams) -> Scene:
        """The scene with the vehicle's camera and push."""
        scene = with_camera(self.scene, vehicle)
        if not self.push:
            return scene
        reach = push_reach(
            vehicle.geometry,
            vehicle.mass_kg * GRAVITY,
            np.array(vehicle.tip_position_m),
            np.array(vehicle.thrust_min),
            np.array(vehicle.thrust_max),
            friction=scene.wall.friction,
            travel=LEFT,
        ).push
        return changed(scene, paint={"push_n": round(self.push * reach, 1)})


@functools.cache
def training() -> dict[str, Training]:
    """Flights of a trial, on scenes of the tuning family: calm, gusts, a sloping edge, and two slides."""
    calm, gusts, slope = (_short(number) for number in range(3))
    sticking, saturated = _near(3), _near(4)
    return {
        "calm": _flight(calm),
        "gusts": _flight(gusts, wind={"gust_n_rms": GUST_N}),
        "slope": _flight(slope, board={"slope_deg": SLOPE_DEG}),
        "sticking slide": _flight(sticking, SLIDE, STICKING_PUSH, wall={"friction": STICKING}),
        "saturated slide": _flight(saturated, SATURATED, SATURATING_PUSH, wall={"friction": SLIPPERY}),
    }


@functools.cache
def checks() -> dict[str, Training]:
    """Further flights of finalists: the whole job, a neglected vehicle, a wall that holds the tip, strong gusts."""
    job, neglected, sticking, gusts = range(5, 9)
    return {
        "whole job": Training(in_world(random_scene(job, TUNING), WORLD)),
        "harsh": Training(in_world(_short(neglected), "harsh")),
        "sticking": _flight(_short(sticking), wall={"friction": STICKING}),
        "strong gusts": _flight(_short(gusts), wind={"gust_n_rms": STRONG_GUST_N}),
    }


def _flight(scene: Scene, task: str = PAINT, push: float = 0.0, **changes: Any) -> Training:
    return Training(in_world(changed(scene, **changes), WORLD), task, push)


def _short(number: int) -> Scene:
    """A scene with short rows, on a board that ends with them."""
    scene = _near(number)
    width = STROKE_M + 2.0 * scene.paint.edge_margin_m
    return changed(scene, paint={"stroke_m": STROKE_M}, board={"width_m": width})


def _near(number: int) -> Scene:
    """A scene of the tuning family that starts near the wall."""
    return changed(random_scene(number, TUNING), start={"distance_m": NEAR_START_M})


def flights(
    flown: Mapping[str, Training], subject: Subject, variant: str, seeds: Iterable[int], features: str
) -> list[Run]:
    """Every training flight with every seed.

    Args:
        flown: Flights by name of their scene.
        subject: Preset with its law, or rival.
        variant: Name of the preset in the table.
        seeds: Seeds.
        features: "geometric" or "rendered".
    """
    rival = {"controller": MPC, "controller_settings": subject.weights} if subject.rival else {}
    return [
        run
        for place, (name, each) in enumerate(flown.items())
        for run in paint_runs(
            each.scene_for(subject.config.controller.vehicle),
            each.config(subject.config),
            tuple(seed + SEED_STRIDE * place for seed in seeds),
            features,
            job=each.job,
            options=rival,
            params={"scene": name, TASK: each.task},
            experiment="tune",
            variant=variant,
            measure=paint_figures if each.task == PAINT else slide_figures,
            overhead_s=_OVERHEAD_S,
        )
    ]


def seeds(first: int, seed: int, count: int) -> range:
    """Seeds of one purpose; searches with different seeds have different ones."""
    return range(first + 10_000 * seed, first + 10_000 * seed + count)
