"""Search for the weights of the predictive rival on tuning scenes, and on a push beyond reach.

    python benchmarks/mpc_weights.py 26 weights.json

Every trial flies two random tuning scenes with strokes of 0.3 m in the datasheet world, and 35 N without reach check.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

import optuna

from ibvs_qp.pilot import Pilot
from sim.evaluate.measures import press_figures
from sim.evaluate.metrics import compute_metrics
from sim.experiments.scenes import changed
from sim.flight import closed_loop
from sim.flight.jobs import Job, PressJob
from sim.flight.options import FlightOptions, default_preset
from sim.flight.trace import Trace
from sim.rivals.horizon import MpcSettings
from sim.rivals.mpc import MpcController
from sim.world.random_scene import TUNING, random_scene
from sim.world.scene import Scene
from sim.world.worlds import in_world

#: Range of every weight, on a logarithmic scale.
RANGES = {
    "line": (3e3, 1e5),
    "line_rate": (1e2, 2e3),
    "height": (1.0, 30.0),
    "push": (0.2, 3.0),
    "tip_rate": (1e3, 1e5),
    "tilt": (3e4, 1e6),
    "thrust_change": (0.03, 1.0),
    "terminal": (1.0, 6.0),
}
#: Cost of a flight that does not end as planned [-]: no flown one costs as much.
FAILED = 20.0
#: Tuning scenes, start, and stroke of a trial [m].
SCENES, START_M, STROKE_M = (1, 4), 0.2, 0.3


def flown(scene: Scene, seed: int, settings: MpcSettings, job: Job | None, reach_check: bool) -> Trace:
    """One flight of the predictive law with these weights."""
    shipped = default_preset("qp")
    config = dataclasses.replace(shipped, controller=dataclasses.replace(shipped.controller, reach_check=reach_check))

    def make_pilot(scene: Scene, options: FlightOptions, config, job: Job) -> Pilot:
        return Pilot(config, job.strategy(config.painting), controller=MpcController(config.controller, settings))

    closed_loop.make_pilot = make_pilot
    options = FlightOptions(seed=seed, features="geometric", video=False, machine_code=True)
    return closed_loop.fly(scene, options, config=config, job=job)


def cost(settings: MpcSettings) -> float:
    """Errors over those of the shipped law, averaged over the flights."""
    total = 0.0
    for seed in SCENES:
        scene = random_scene(seed, TUNING)
        paint, width = {"stroke_m": STROKE_M, "rows": 2}, STROKE_M + 2.0 * scene.paint.edge_margin_m
        scene = changed(scene, paint=paint, start={"distance_m": START_M}, board={"width_m": width})
        trace = flown(in_world(scene, "datasheet"), seed, settings, None, reach_check=True)
        if not trace.completed:
            total += FAILED
            continue
        m = compute_metrics(trace)
        corner, tilt, peak = m["path_rms_corner_m"] / 4e-3, m["tilt_rms_deg"] / 0.8, m["force_peak_n"] / 5.5 - 1.0
        total += m["path_rms_straight_m"] / 2.5e-3 + m["force_rms_straight_n"] / 0.17
        total += 0.5 * (corner + tilt + max(peak, 0.0))
    scene = changed(Scene(), start={"distance_m": 0.15}, paint={"push_n": 35.0})
    trace = flown(scene, 0, settings, PressJob(hold_s=9.0), reach_check=False)
    if not trace.completed:
        return 0.5 * total + FAILED
    m = press_figures(trace)
    short, height = max(30.0 - m["push_mean_n"], 0.0) / 2.0, m["height_error_peak_m"] / 5e-3
    return 0.5 * (total + short + m["force_std_n"] + height + 0.5 * m["tilt_peak_deg"])


def suggested(trial: optuna.Trial) -> MpcSettings:
    """Settings of a trial; the yaw weight is half of the tilt weight."""
    values = {name: trial.suggest_float(name, low, high, log=True) for name, (low, high) in RANGES.items()}
    return MpcSettings(**values, yaw=0.5 * values["tilt"])


def main() -> None:
    """Search, and write every trial."""
    trials, file = int(sys.argv[1]), Path(sys.argv[2])
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=0, n_startup_trials=8))
    study.enqueue_trial({name: getattr(MpcSettings(), name) for name in RANGES})
    found = []

    def note(study: optuna.Study, trial: optuna.trial.FrozenTrial) -> None:
        found.append({"cost": trial.value, **trial.params})
        file.write_text(json.dumps(found, indent=1), encoding="utf-8")
        print(f"{trial.number}: {trial.value:.2f}", {k: float(f"{v:.3g}") for k, v in trial.params.items()}, flush=True)

    study.optimize(lambda trial: cost(suggested(trial)), n_trials=trials, callbacks=[note])


if __name__ == "__main__":
    main()
