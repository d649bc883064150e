"""Flights: short jobs on random scenes in a trial, and four harder ones before the choice of a preset."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ibvs_qp.pilot import PilotConfig
from sim.evaluate.measures import paint_figures, slide_figures
from sim.experiments.preset_flights import paint_runs
from sim.experiments.scenes import NEAR_START_M, changed
from sim.flight.jobs import Job, PaintJob, PressJob
from sim.sweep.design import Run
from sim.tune.objectives import PAINT, SLIDE, TASK
from sim.tune.space import RIVAL, Subject
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
#: Slide at the reach: friction, and push [N] of which the rotors can hold 84 %.
STICKING, STICKING_PUSH_N = 0.8, 10.0
#: Slide beyond the reach, which the law has to find by itself: friction, and push [N]; 15.8 N can be held.
SLIPPERY, SATURATING_PUSH_N = 0.3, 20.0
#: Hold and slide [s].
SLIDING = PressJob(hold_s=2.0, slide_s=4.0)
#: Starts, approaches and retreats beside the strokes [s]; sizes the progress bar only.
_OVERHEAD_S = 9.0


@dataclass(frozen=True)
class Training:
    """A job on a scene.

    Attributes:
        scene: The scene.
        job: The job.
        reach_check: Whether the push is reduced to what the rotors can hold.
    """

    scene: Scene
    job: Job = field(default_factory=PaintJob)
    reach_check: bool = True

    @property
    def task(self) -> str:
        """Task, which decides on the objectives."""
        return PAINT if isinstance(self.job, PaintJob) else SLIDE

    def config(self, config: PilotConfig) -> PilotConfig:
        """A preset for this job."""
        controller = dataclasses.replace(config.controller, reach_check=self.reach_check)
        return dataclasses.replace(config, controller=controller)


@functools.cache
def training() -> dict[str, Training]:
    """Flights of a trial, on scenes of the tuning family: calm, gusts, a sloping edge, and two slides."""
    calm, gusts, slope, sticking, saturated = (_short(number) for number in range(5))
    return {
        "calm": _flight(calm),
        "gusts": _flight(gusts, wind={"gust_n_rms": GUST_N}),
        "slope": _flight(slope, board={"slope_deg": SLOPE_DEG}),
        "sticking slide": _flight(sticking, SLIDING, wall={"friction": STICKING}, paint={"push_n": STICKING_PUSH_N}),
        "saturated slide": _flight(
            saturated, SLIDING, False, wall={"friction": SLIPPERY}, paint={"push_n": SATURATING_PUSH_N}
        ),
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


def _flight(scene: Scene, job: Job | None = None, reach_check: bool = True, **changes: Any) -> Training:
    return Training(in_world(changed(scene, **changes), WORLD), job or PaintJob(), reach_check)


def _short(number: int) -> Scene:
    """A scene of the tuning family that starts near the wall and has short rows."""
    scene = random_scene(number, TUNING)
    return changed(scene, paint={"stroke_m": STROKE_M}, start={"distance_m": NEAR_START_M})


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
    rival = {"rival": RIVAL, "rival_settings": subject.weights} if subject.rival else {}
    return [
        run
        for place, (name, each) in enumerate(flown.items())
        for run in paint_runs(
            with_camera(each.scene, subject.config.controller.vehicle),
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
