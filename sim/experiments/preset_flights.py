"""Paint flights under a preset, for the comparison of presets."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ibvs_qp.pilot import PilotConfig
from sim.evaluate.measures import paint_figures
from sim.experiments.scenes import near_wall, short_job
from sim.flight.jobs import PaintJob
from sim.flight.options import FlightOptions, pilot_config
from sim.sweep.design import FlightPlan, Run

#: Stroke of the quick job [m].
QUICK_STROKE_M = 0.4


def preset_runs(name: str, preset: Path, law: str, seeds: Iterable[int], features: str, quick: bool) -> list[Run]:
    """Paint jobs under a preset.

    Args:
        name: Variant under which its rows go.
        preset: TOML file.
        law: "qp", "paper", or "own" for the one that the preset names.
        seeds: Seeds to fly.
        features: "rendered" or "geometric".
        quick: Short strokes.

    Raises:
        ConfigError: When the preset is refused.
    """
    pilot = PilotConfig.from_toml(preset)
    scene = short_job(QUICK_STROKE_M) if quick else near_wall()
    flown = pilot.law if law == "own" else law
    runs = []
    for seed in seeds:
        options = FlightOptions(law=flown, seed=seed, features=features, video=False)
        runs.append(
            Run(
                experiment="paint",
                variant=name,
                params={"stroke_m": scene.paint.stroke_m},
                plan=FlightPlan(scene=scene, config=pilot_config(scene, options, pilot), options=options),
                measure=paint_figures,
                expected_s=PaintJob().expected_s(pilot_config(scene, options, pilot).painting),
            )
        )
    return runs
