"""Sets of flights over whole walls, and the figures of one flight."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sim.evaluate.measures import paint_figures
from sim.evaluate.truth import Assessment
from sim.experiments.whole_walls.scenes import walls
from sim.experiments.whole_walls.vision_faults import faulty_jobs
from sim.faults.fault import Fault
from sim.flight.jobs import PaintJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.preflight import check_job
from sim.flight.trace import Trace
from sim.sweep.design import FlightPlan, Run
from sim.world.board import BoardGeometry
from sim.world.scene import Scene
from sim.world.worlds import DEFAULT_WORLD, HARSH, in_world

#: Stroke whose place error those of the last strokes are compared with.
EARLY_STROKE = 5
#: Number of scenes of the sensor model and of pictures, and of strokes of the latter.
SCENES, RENDERED_SCENES, RENDERED_STROKES = 20, 6, 10
#: Start, approach, alignment, touch and retreat [s]; sizes the plan only.
_AROUND_S = 9.0

#: Sets of flights.
SETS = ("datasheet", HARSH, "rendered", "faults", "faults rendered")


def runs_of(sets: Sequence[str], laws: Sequence[str], seed: int = 0) -> list[Run]:
    """Flights of some sets, the shortest first."""
    runs = (run for name in sets for run in (fault_runs if "faults" in name else wall_runs)(name, laws, seed))
    return sorted(runs, key=lambda run: run.expected_s)


def wall_runs(name: str, laws: Sequence[str], seed: int = 0) -> list[Run]:
    """Flights of a set over whole walls: every scene under each law, with one seed.

    Args:
        name: "datasheet", "harsh" or "rendered".
        laws: The laws.
        seed: Of the design.
    """
    if name == "rendered":
        scenes, features = walls(seed, RENDERED_SCENES, (RENDERED_STROKES,), ("rows",)), name
    else:
        scenes, features = walls(seed, SCENES), "geometric"
    world = HARSH if name == HARSH else DEFAULT_WORLD
    return [
        paint_run(name, "standard", in_world(scene, world), law, seed + number, features)
        for number, scene in enumerate(scenes)
        for law in laws
    ]


def fault_runs(name: str, laws: Sequence[str], seed: int = 0) -> list[Run]:
    """Flights of a set with faults in vision, in the default world; arguments as of `wall_runs`."""
    features = "rendered" if "rendered" in name else "geometric"
    return [
        paint_run(name, row, in_world(scene, DEFAULT_WORLD), law, number, features, faults)
        for row, number, scene, faults in faulty_jobs(seed, features)
        for law in laws
    ]


def paint_run(
    name: str, variant: str, scene: Scene, law: str, seed: int, features: str, faults: tuple[Fault, ...] = ()
) -> Run:
    """One paint job, checked before anything flies; its trace is kept.

    Raises:
        ConfigError: When the job is refused.
    """
    options = FlightOptions(law=law, seed=seed, features=features, video=False, compiled=True)
    config = pilot_config(scene, options)
    check_job(scene, config, features)
    board, paint = scene.board, scene.paint
    strokes = BoardGeometry(scene).strokes
    return Run(
        experiment=name,
        variant=variant,
        params={
            "strokes": strokes,
            "pattern": paint.pattern,
            "start": paint.start,
            "width_m": round(board.width_m, 3),
            "height_m": round(board.height_m, 3),
            "clutter": board.clutter,
        },
        plan=FlightPlan(scene=scene, config=config, options=options, faults=faults),
        measure=wall_figures,
        trace=True,
        expected_s=_AROUND_S + PaintJob().expected_s(config.painting, strokes),
    )


def wall_figures(trace: Trace) -> dict[str, float]:
    """Figures of a paint job; whether the truth completes it; place error of the last stroke over that of stroke 5."""
    assessment, last = Assessment(trace), BoardGeometry(trace.scene).strokes
    figures = paint_figures(trace) | {"done": float(assessment.completed), "place_growth": math.nan}
    if last > EARLY_STROKE and {EARLY_STROKE, last} <= assessment.strokes.keys():
        early, late = (abs(assessment.strokes[number].place_error_m) for number in (EARLY_STROKE, last))
        figures["place_growth"] = late / early
    return figures
