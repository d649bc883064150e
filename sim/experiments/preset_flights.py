"""Paint flights under a preset, for the comparison of presets and for tuning."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ibvs_qp.pilot import PilotConfig
from sim.evaluate.measures import paint_figures
from sim.experiments.scenes import near_wall, short_job
from sim.flight.jobs import Job, PaintJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.preflight import check_job
from sim.sweep.design import FlightPlan, Measure, Run
from sim.world.board import BoardGeometry
from sim.world.scene import Scene
from sim.world.worlds import DEFAULT_WORLD, in_world

#: Stroke of the quick job [m].
QUICK_STROKE_M = 0.4


def paint_runs(
    scene: Scene,
    config: PilotConfig,
    seeds: Iterable[int],
    features: str,
    *,
    measure: Measure = paint_figures,
    overhead_s: float = 0.0,
    job: Job | None = None,
    options: Mapping[str, Any] | None = None,
    **cell: Any,
) -> list[Run]:
    """Paint jobs, or others, of one scene under a preset and its law.

    Args:
        scene: The scene.
        config: The preset.
        seeds: Seeds to fly.
        features: "rendered" or "geometric".
        measure: Figures of a flight.
        overhead_s: Start, approaches and retreats in addition to the strokes [s]; sizes the progress bar only.
        job: Job at the wall; default: paint.
        options: Further `FlightOptions`.
        cell: ``experiment``, ``variant`` and ``params`` of the runs.
    """
    pilot = pilot_config(scene, FlightOptions(law=config.law), config)
    job = job or PaintJob()
    check_job(scene, pilot, features, job)
    expected_s = overhead_s + job.expected_s(pilot.painting, BoardGeometry(scene).strokes)
    return [
        Run(
            plan=FlightPlan(
                scene=scene,
                config=pilot,
                options=FlightOptions(law=config.law, seed=seed, features=features, video=False, **(options or {})),
                job=job,
            ),
            measure=measure,
            expected_s=expected_s,
            **cell,
        )
        for seed in seeds
    ]


def preset_runs(
    name: str,
    preset: Path,
    law: str,
    seeds: Iterable[int],
    features: str,
    quick: bool,
    world: str = DEFAULT_WORLD,
) -> list[Run]:
    """Paint jobs under a preset file.

    Args:
        name: Variant under which its rows go.
        preset: TOML file.
        law: "qp", "paper", or "own" for the one that the preset names.
        seeds: Seeds to fly.
        features: "rendered" or "geometric".
        quick: Short strokes.
        world: Errors of vehicle and sensors.

    Raises:
        ConfigError: When the preset or the world is refused.
    """
    pilot = PilotConfig.from_toml(preset)
    scene = in_world(short_job(QUICK_STROKE_M) if quick else near_wall(), world)
    pilot = pilot if law == "own" else dataclasses.replace(pilot, law=law)
    params = {"stroke_m": scene.paint.stroke_m}
    return paint_runs(scene, pilot, seeds, features, experiment="paint", variant=name, params=params)
