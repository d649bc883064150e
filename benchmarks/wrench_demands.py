"""Errors of every allocation method on random wrench demands beyond reach: delivered minus demanded, rms.

Run as ``python benchmarks/wrench_demands.py [--count 4000] [--json]``. The QP has the rows, weights and thrust
limit of the controller without lines; the demand is the target of its rows.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Callable
from typing import Any

import casadi as ca
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
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import Parameter, TaskRow
from ibvs_qp.qp.accept import QpEngine
from ibvs_qp.qp.problem import QpProblem, RecordedProgram
from ibvs_qp.tasks import EffortTask, SmoothnessTask, Task

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


class DemandedWrench(Task):
    """A demanded wrench through the rows of the shipped tasks: push along front, velocity right and down, level, yaw.

    Args:
        height_weight: Weight of the height row.
    """

    def __init__(self, height_weight: float) -> None:
        self._height_weight, self.acceleration = height_weight, Parameter("demanded_acceleration", [0.0] * 6)

    def rows(self, model: Model) -> list[TaskRow]:
        """Rows of push [N], velocity and height [m/s^2], roll, pitch and yaw [rad/s^2]."""
        weights, target, found = CONFIG.weights, model.parameter(self.acceleration), model.acceleration
        mass = CONFIG.vehicle.mass_kg
        rows = (
            ("push", "N", mass, 0, weights.push),
            ("velocity_right", "m/s^2", 1.0, 1, weights.velocity),
            ("velocity_down", "m/s^2", 1.0, 2, weights.velocity),
            ("roll", "rad/s^2", 1.0, 3, weights.level),
            ("pitch", "rad/s^2", 1.0, 4, weights.level),
            ("yaw", "rad/s^2", 1.0, 5, weights.yaw),
            ("height", "m/s^2", 1.0, 2, self._height_weight),
        )
        return [
            TaskRow(name=name, unit=unit, expression=scale * found[i], target=scale * target[i], weight=ca.SX(weight))
            for name, unit, scale, i, weight in rows
        ]


class ProgramAllocation:
    """The QP of the controller without lines, for one demanded wrench at a time.

    Attributes:
        outcomes: Number of demands per outcome of the solver.
        unallocated: Wrench of the last solution without limits minus its wrench, (6,) [N, N m].
    """

    def __init__(self, height_weight: float | None = None) -> None:
        weight = CONFIG.weights.height if height_weight is None else height_weight
        tasks = [DemandedWrench(weight), EffortTask(), SmoothnessTask()]
        problem = QpProblem(Model(CONFIG), tasks, [ThrustLimit()])
        self._program = RecordedProgram(problem)
        self._engine = QpEngine(problem, CONFIG.solver, self._program)
        inputs = self._program.inputs
        inputs["attitude"][0] = inputs["normal"][0] = 1.0
        inputs["thrust_last"][:] = WEIGHT / -B[2].sum()
        inputs["thrust_step"][0] = UPPER.max()
        for low, high in (("low", "high"), ("floor", "ceiling")):
            inputs[f"thrust_{low}"][:], inputs[f"thrust_{high}"][:] = LOWER, UPPER
        self.outcomes: Counter[str] = Counter()
        self.unallocated = np.zeros(6)

    def __call__(self, wrench: np.ndarray) -> np.ndarray:
        """Thrusts for one demanded rotor wrench [N], (n,)."""
        net = wrench + np.array([0.0, 0.0, WEIGHT, 0.0, 0.0, 0.0])
        self._program.inputs["demanded_acceleration"][:] = net / CONFIG.vehicle.mass_matrix.diagonal()
        self._program.evaluate()
        solution = self._engine.solve()
        assert solution is not None
        self.outcomes[str(solution.outcome)] += 1
        self.unallocated = B @ (self._program.free - solution.thrusts)
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
