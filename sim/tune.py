"""Search for gains: the same search, budget and flights for both laws.

Run as ``python -m sim.tune --law qp --trials 120``; needs the extra ``tune`` (Optuna). Each trial flies a short paint
job on geometric features and is scored by the figures that the report shows. Trials are asked for in batches of two
and told in order, so the result depends on the seed alone and not on the number of processes.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import joblib
import numpy as np

from ibvs_qp.config import Gains
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.settings import dump_toml
from sim.closed_loop import FlightOptions, default_preset, fly
from sim.metrics import compute_metrics
from sim.scene import BoardScene, ForceTorqueScene, PaintScene, Scene, StartScene, VehicleScene, WallScene

if TYPE_CHECKING:
    import optuna

#: Search range of every gain, both laws alike: [low, high] on a logarithmic scale.
RANGES = {
    "line_kp": (4.0, 40.0),
    "line_kd": (3.0, 14.0),
    "line_ki": (0.5, 15.0),
    "theta_kp": (4.0, 60.0),
    "theta_kd": (3.0, 16.0),
    "line_turn_share": (0.1, 1.0),
    "velocity_kp": (1.0, 8.0),
    "velocity_ki": (0.3, 6.0),
    "attitude_kp": (15.0, 80.0),
    "attitude_kd": (6.0, 18.0),
    "yaw_kp": (8.0, 60.0),
    "yaw_kd": (4.0, 16.0),
    "force_ksp": (10.0, 300.0),
    "force_ksd": (30.0, 250.0),
    "force_kfp": (0.05, 1.0),
    "force_kfi": (0.4, 5.0),
}
#: What counts as one unit of cost: the figures the main job is held to, halved.
SCALES = {
    "path_rms_straight_m": 0.0025,
    "path_rms_corner_m": 0.0075,
    "force_rms_straight_n": 0.175,
    "force_rms_corner_n": 0.3,
    "force_peak_n": 3.75,
    "tilt_rms_deg": 0.5,
    "tilt_peak_deg": 1.5,
    "yaw_peak_deg": 1.5,
    "settle_s": 1.5,
}
#: Cost of a flight that does not complete, and of each figure that is not known.
FAILURE, UNKNOWN = 100.0, 5.0
#: Trials evaluated side by side.
BATCH = 2


def training_scenes() -> tuple[tuple[Scene, int], ...]:
    """Scenes and seeds flown per trial: a nominal and a harder wall, short strokes; tests and reports use others."""
    paint = dataclasses.replace(PaintScene(), stroke_m=0.25)
    board = dataclasses.replace(BoardScene(), width_m=paint.stroke_m + 2.0 * paint.edge_margin_m)
    nominal = Scene(paint=paint, board=board, start=dataclasses.replace(StartScene(), distance_m=0.2))
    hard = dataclasses.replace(
        nominal,
        wall=dataclasses.replace(WallScene(), friction=0.6, stiffness_n_m=4000.0),
        vehicle=dataclasses.replace(VehicleScene(), mass_kg=6.5),
        force_torque=dataclasses.replace(ForceTorqueScene(), sigma_n=0.4),
    )
    return (nominal, 100), (hard, 101)


def cost(law: str, gains: dict[str, float]) -> float:
    """Mean cost of the training flights: sum over `SCALES` of figure / scale, or `FAILURE`."""
    total = []
    for scene, seed in training_scenes():
        config = default_preset(law)
        controller = dataclasses.replace(config.controller, gains=Gains(**gains))
        options = FlightOptions(law=law, seed=seed, features="geometric", video=False)
        trace = fly(scene, options, config=dataclasses.replace(config, controller=controller))
        figures = compute_metrics(trace)
        if not trace.completed:
            total.append(FAILURE)
            continue
        parts = [figures[name] / scale for name, scale in SCALES.items()]
        total.append(sum(part if np.isfinite(part) else UNKNOWN for part in parts))
    return float(np.mean(total))


def search(law: str, trials: int, seed: int, jobs: int) -> optuna.Study:
    """Run the search from the shipped gains on; the first trial is the shipped set."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed, multivariate=True))
    shipped = dataclasses.asdict(default_preset(law).controller.gains)
    study.enqueue_trial({name: shipped[name] for name in RANGES})
    with joblib.Parallel(n_jobs=jobs) as parallel:
        while len(study.trials) < trials:
            batch = [study.ask() for _ in range(BATCH)]
            sets = [{name: t.suggest_float(name, *span, log=True) for name, span in RANGES.items()} for t in batch]
            values = parallel(joblib.delayed(cost)(law, {**shipped, **gains}) for gains in sets)
            for trial, value in zip(batch, values, strict=True):
                study.tell(trial, value)
            print(f"{law}: {len(study.trials)} trials, best {study.best_value:.3f}", flush=True)
    return study


@dataclass(frozen=True, kw_only=True)
class Tune:
    """Tune the gains of one law, e.g. ``python -m sim.tune --law paper --trials 120``.

    Attributes:
        law: Law to tune, qp or paper.
        trials: Number of trials.
        seed: Seed of the search.
        jobs: Processes side by side; the result does not depend on it.
        out: Folder for the preset and the trials.
    """

    law: str = "qp"
    trials: int = 120
    seed: int = 0
    jobs: int = 2
    out: Path = Path("runs/tune")

    def run(self) -> None:
        """Search and write ``<law>.toml`` (a preset) and ``<law>_trials.json`` (every trial and its cost)."""
        study = search(self.law, self.trials, self.seed, self.jobs)
        preset = default_preset(self.law)
        best = {name: float(f"{value:.4g}") for name, value in study.best_params.items()}
        gains = dataclasses.replace(preset.controller.gains, **best)
        tuned: PilotConfig = dataclasses.replace(preset, controller=dataclasses.replace(preset.controller, gains=gains))
        self.out.mkdir(parents=True, exist_ok=True)
        (self.out / f"{self.law}.toml").write_text(dump_toml(tuned), encoding="utf-8")
        rows: list[dict[str, Any]] = [{"cost": trial.value, **trial.params} for trial in study.trials]
        record = {"law": self.law, "seed": self.seed, "trials": rows, "best": best, "best_cost": study.best_value}
        (self.out / f"{self.law}_trials.json").write_text(json.dumps(record, indent=1), encoding="utf-8")
        print(f"shipped gains cost {rows[0]['cost']:.3f}, best {study.best_value:.3f}: {self.out / self.law}.toml")


if __name__ == "__main__":
    import tyro

    tyro.cli(Tune).run()
