"""Errors of every allocation method on random wrench demands beyond reach: delivered minus demanded, rms.

Run as ``python benchmarks/wrench_demands.py [--count 4000] [--json]``. The program is assembled from the controller's
own tasks and limits with the controller's own weights; the demand is the target of its rows.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from allocation import (
    TAROT_T960,
    allocate_least_squares,
    allocate_pseudo_inverse,
    allocate_px4,
    allocate_sequential,
    control_effectiveness,
)
from ibvs_qp.config import ControllerConfig
from ibvs_qp.frames import GRAVITY
from ibvs_qp.limits import ThrustLimit
from ibvs_qp.model.rows import SymbolicModel
from ibvs_qp.qp.accept import QpEngine
from ibvs_qp.qp.problem import QpTemplate
from ibvs_qp.tasks import EffortTask, HeightTask, LevelTask, PushTask, SmoothnessTask, VelocityTask, YawTask

#: Half widths of the uniform demands about hover: lateral, vertical, roll and pitch, yaw [N, N m].
LATERAL, VERTICAL, TIP_OVER, TURN = 40.0, 15.0, 3.0, 4.0
CONFIG = ControllerConfig()
B = control_effectiveness(TAROT_T960)
LOWER, UPPER = CONFIG.vehicle.thrust_min, CONFIG.vehicle.thrust_max
WEIGHT = CONFIG.vehicle.mass_kg * GRAVITY


def demands(count: int, seed: int = 0) -> np.ndarray:
    """Random wrenches beyond the reach of the rotors, (count, 6) [N, N m]."""
    rng, inverse = np.random.default_rng(np.random.SeedSequence(seed)), np.linalg.inv(B)
    half = np.array([LATERAL, LATERAL, VERTICAL, TIP_OVER, TIP_OVER, TURN])
    found: list[np.ndarray] = []
    while len(found) < count:
        wrench = rng.uniform(-half, half) - [0.0, 0.0, WEIGHT, 0.0, 0.0, 0.0]
        thrusts = inverse @ wrench
        if (thrusts < LOWER).any() or (thrusts > UPPER).any():
            found.append(wrench)
    return np.array(found)


class ProgramAllocation:
    """The controller's program without lines: push along front, velocity right and down, level, yaw, height.

    Attributes:
        outcomes: Number of programs per outcome of the solver.
        unallocated: Wrench of the last program without limits minus its wrench, (6,) [N, N m].
    """

    def __init__(self, height_weight: float | None = None) -> None:
        tasks = [PushTask(), LevelTask(), YawTask(), VelocityTask(), HeightTask(), EffortTask(), SmoothnessTask()]
        template = QpTemplate(SymbolicModel(CONFIG), tasks, [ThrustLimit()])
        self._engine = QpEngine(template, CONFIG.solver)
        self._data = self._engine.data
        values, hover = self._data.parameters, np.full(B.shape[1], WEIGHT / -B[2].sum())
        fixed: dict[str, Any] = {
            "bias_wrench": (0.0, 0.0, WEIGHT, 0.0, 0.0, 0.0),
            "normal": (1.0, 0.0, 0.0),
            "axis_right": (0.0, 1.0, 0.0),
            "axis_down": (0.0, 0.0, 1.0),
            "last_thrust": hover,
            "extrapolated_thrust": hover,
            "thrust_lower": LOWER,
            "thrust_upper": UPPER,
        }
        for name, value in fixed.items():
            values[name][:] = value
        self._height = CONFIG.weights.height if height_weight is None else height_weight
        self.outcomes: Counter[str] = Counter()
        self.unallocated = np.zeros(6)

    def __call__(self, wrench: np.ndarray) -> np.ndarray:
        """Thrusts for one demanded rotor wrench [N], (n,)."""
        values, weights, vehicle = self._data.parameters, CONFIG.weights, CONFIG.vehicle
        net = wrench + values["bias_wrench"]
        right, down = net[1] / vehicle.mass_kg, net[2] / vehicle.mass_kg
        roll, pitch, yaw = net[3:] / np.array(vehicle.inertia_kg_m2)
        values["push"][:] = net[0], weights.push
        values["velocity_right"][:] = right, weights.velocity
        values["velocity_down"][:] = down, weights.velocity
        values["height"][:] = down, self._height
        values["level"][:] = roll, pitch, weights.level
        values["yaw"][:] = yaw, weights.yaw
        solution = self._engine.solve()
        assert solution is not None
        self.outcomes[str(solution.outcome)] += 1
        self.unallocated = B @ (self._data.free - solution.thrusts)
        return solution.thrusts


def row(method: Callable[[np.ndarray], np.ndarray], desired: np.ndarray) -> dict[str, float]:
    """Errors of one method, rms over all demands [N, N m]."""
    error = np.array([B @ method(wrench) - wrench for wrench in desired])
    front, right, lift, roll, pitch, yaw = np.sqrt((error**2).mean(axis=0)).tolist()
    return {
        "lateral_n": float(np.hypot(front, right)),
        "vertical_n": lift,
        "roll_pitch_nm": float(np.hypot(roll, pitch)),
        "yaw_nm": yaw,
    }


def table(count: int, seed: int = 0) -> dict[str, Any]:
    """Every method on the same demands."""
    desired = demands(count, seed)
    program, level = ProgramAllocation(), ProgramAllocation(height_weight=0.0)
    methods: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        "pseudo-inverse, clipped": lambda wrench: allocate_pseudo_inverse(wrench, B, LOWER, UPPER)[0],
        "PX4 order, airmode off": lambda wrench: allocate_px4(wrench, B, LOWER, UPPER),
        "PX4 order, airmode full": lambda wrench: allocate_px4(wrench, B, LOWER, UPPER, airmode=True),
        "sequential, lateral first": lambda wrench: allocate_sequential(wrench, B, LOWER, UPPER),
        "box least squares": lambda wrench: allocate_least_squares(wrench, B, LOWER, UPPER),
        "program": program,
        "program without height row": level,
    }
    rows = {name: row(method, desired) for name, method in methods.items()}
    return {"schema": 1, "count": count, "seed": seed, "rows": rows, "outcomes": dict(program.outcomes)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=4000, help="demands")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true", help="one JSON line instead of the table")
    arguments = parser.parse_args()
    result = table(arguments.count, arguments.seed)
    if arguments.json:
        print(json.dumps(result))
        return
    print("| method | lateral N | vertical N | roll/pitch N m | yaw N m |\n|---|---|---|---|---|")
    for name, errors in result["rows"].items():
        print(f"| {name} | " + " | ".join(f"{value:.2f}" for value in errors.values()) + " |")
    print(f"\n{arguments.count} demands, seed {arguments.seed}; outcomes of the program: {result['outcomes']}")


if __name__ == "__main__":
    main()
