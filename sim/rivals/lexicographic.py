"""Strict priorities: the rows, limits, estimates and references of the shipped law, solved level by level."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from scipy import sparse

from ibvs_qp.command import Outcome
from ibvs_qp.config import SolverSettings
from ibvs_qp.controller import HybridController
from ibvs_qp.limits.limit import Limit
from ibvs_qp.model.model import Model
from ibvs_qp.qp.accept import QpEngine
from ibvs_qp.qp.problem import AffineRows, ProgramData, QpProblem
from ibvs_qp.qp.solver import ACTIVE_MULTIPLIER, AcceptedSolution
from ibvs_qp.tasks.task import Task
from sim.rivals.solver import BackedSolver

#: Task rows by the start of their names, highest priority first. The order is that of the shipped weights per squared
#: newton of thrust or force: roll and pitch 1900 and yaw 110 (400 over inertia, times lever), height 44, lines 11,
#: velocity 2.8, push and stand-off 0.5, and the rest at most 0.001. Height, lines and velocity command the same two
#: directions, so they share a level. Other orders fly worse: with yaw beside roll and pitch a vehicle that lost a
#: rotor brakes its turn and strikes the wall; with the push above height a push beyond reach lifts the tip by 28 mm.
LEVELS: tuple[tuple[str, ...], ...] = (
    ("roll", "pitch"),
    ("yaw",),
    ("height", "line", "velocity"),
    ("push", "standoff"),
    ("effort", "smooth"),
)
#: End of the names of angle rows; at 0.05 rad they belong to the lowest level: a sloped edge must not tilt.
ANGLE = "_angle"


def row_levels(names: Sequence[str], levels: Sequence[Sequence[str]] = LEVELS) -> list[np.ndarray]:
    """Indices of the rows of every level; a row of an unknown name and an angle row have the lowest priority."""
    found: list[list[int]] = [[] for _ in levels]
    for index, name in enumerate(names):
        fits = [k for k, starts in enumerate(levels) if name.startswith(tuple(starts)) and not name.endswith(ANGLE)]
        found[fits[0] if fits else -1].append(index)
    return [np.array(indices, int) for indices in found]


class PriorityProblem(QpProblem):
    """The shipped rows, and in addition to the weighted program the rows one by one: matrix, target and weight.

    Attributes:
        levels: Indices of the task rows of every level, highest priority first.
    """

    def __init__(self, model: Model, tasks: Sequence[Task], limits: Sequence[Limit]) -> None:
        super().__init__(model, tasks, limits)
        rows = AffineRows(model, ca.vertcat(*(row.expression for row in self.task_rows)))
        targets = ca.vertcat(*(row.target for row in self.task_rows)) - rows.constant
        weights = ca.vertcat(*(row.weight for row in self.task_rows))
        self.values += [ca.vec(ca.densify(rows.per_thrust)), ca.densify(targets), ca.densify(weights)]
        self.levels = row_levels([row.name for row in self.task_rows])


#: Curvature of a level in directions that none of its rows contains, over its largest [-]: thrusts stay there where the
#: level above put them.
PROXIMAL = 1e-6
#: Rows of less weight, over the largest of their level, are absent [-].
ABSENT = 1e-3
#: Least curvature of a level by which its cost is divided, and least length of a row that counts as one [-].
LEAST_CURVATURE, RANK = 1e-9, 1e-6


def null_space(rows: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Orthonormal steps out of a basis, (n, free), that change none of the rows, (rows, n)."""
    lengths = np.linalg.norm(rows, axis=1)
    seen = rows[lengths > 0.0] / lengths[lengths > 0.0, None] @ basis
    _, singular, right = np.linalg.svd(seen)
    return basis @ right[int((singular > RANK).sum()) :].T


class CascadeEngine(QpEngine):
    r"""Strict priorities: limits first, then the task rows level by level.

    Level 0 finds the least slack of the soft limits. Level k minimises its own rows
    :math:`\sum w_i (J_i u - t_i)^2` subject to all limits, relaxed by that slack, and to
    :math:`J_j u = J_j u^*_j` for every row j of the levels above, kept by steps in their null space: their residuals
    stay optimal. Weights decide only within a level.

    Source: Kanoun, Lamiraux and Wieber, Kinematic control of redundant manipulators: generalizing the task-priority
        framework to inequality task, IEEE Transactions on Robotics 2011.
    """

    def __init__(self, problem: QpProblem, settings: SolverSettings, data: ProgramData) -> None:
        assert isinstance(problem, PriorityProblem)
        super().__init__(problem, settings, data)
        flat, self._targets, self._weights = data.further
        self._matrix = flat.reshape(self._rotors, -1).T
        n, rows = self._rotors, len(problem.row_names)
        self._slacks, self._levels = data.q.size - n, problem.levels
        self._soft = problem.row_slack >= 0
        self._first = BackedSolver(sparse.csc_matrix(np.eye(n + self._slacks)), problem.a_pattern, settings)
        upper, full = sparse.csc_matrix(np.triu(np.ones((n, n)))), sparse.csc_matrix(np.ones((rows, n)))
        self._parts = [BackedSolver(upper, full, settings) for _ in self._levels]

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        for part in (self._first, *self._parts):
            part.solver.reset()

    def solve(self) -> AcceptedSolution | None:
        """Solve the cascade of this tick; None if a level has no solution."""
        n, soft = self._rotors, self._soft
        slack = self._least_slack()
        if slack is None:
            return None
        taken = np.zeros(len(soft))
        taken[soft] = slack[self.problem.row_slack[soft] - n]
        lower, upper = self.data.lower + np.minimum(taken, 0.0), self.data.upper + np.maximum(taken, 0.0)
        thrusts, basis = np.clip(self.data.free, self._lower, self._upper), np.eye(n)
        multipliers = np.zeros(len(soft))
        for indices, part in zip(self._levels, self._parts, strict=True):
            weights = self._weights[indices]
            present = weights > ABSENT * weights.max()
            indices, weights = indices[present], weights[present]
            found = self._solve_level(part, indices, weights, thrusts, basis, lower, upper)
            if found is None:
                return None
            thrusts, y = found
            multipliers = np.where(np.abs(y) > np.abs(multipliers), y, multipliers)
            basis = null_space(self._matrix[indices], basis)
            if not basis.shape[1]:
                break
        return self._answer(thrusts, slack, multipliers)

    def _least_slack(self) -> np.ndarray | None:
        """Least slack of the soft limits, by their slack weights, (slacks,)."""
        data, n = self.data, self._rotors
        weights = data.p[-self._slacks :] if self._slacks else np.zeros(0)
        scale = weights.max(initial=1.0)
        p = np.concatenate((np.full(n, PROXIMAL), weights / scale))
        centre = np.concatenate((np.clip(data.unlimited[:n], self._lower, self._upper), np.zeros(self._slacks)))
        found = self._first.solve(p, -PROXIMAL * centre, data.a, data.lower, data.upper)
        return None if found is None else found[0][n:]

    def _solve_level(
        self,
        part: BackedSolver,
        indices: np.ndarray,
        weights: np.ndarray,
        centre: np.ndarray,
        basis: np.ndarray,
        lower: np.ndarray,
        upper: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Thrusts of a level, and multipliers of the limits in units of its cost.

        Args:
            part: The level's solvers.
            indices: Its rows.
            weights: Their weights.
            centre: Thrusts of the level above [N], (n,); zero steps keep every limit.
            basis: Steps that change no row of a level above, (n, free).
            lower: Lower bounds of the limits, relaxed by the least slack.
            upper: Upper bounds.
        """
        n, free = basis.shape
        steps = np.hstack((basis, np.zeros((n, n - free))))
        matrix = self._matrix[indices]
        weighted = steps.T @ matrix.T * weights
        hessian = weighted @ matrix @ steps
        scale = max(float(hessian.diagonal().max()), LEAST_CURVATURE)
        curvature = hessian / scale + np.diag(np.where(np.arange(n) < free, PROXIMAL, 1.0))
        gradient = weighted @ (matrix @ centre - self._targets[indices]) / scale
        rows = self.data.rows()[:, :n]
        at = rows @ centre
        low, high = np.minimum(lower - at, 0.0), np.maximum(upper - at, 0.0)
        found = part.solve(curvature[np.tril_indices(n)], gradient, (rows @ steps).T.ravel(), low, high)
        return None if found is None else (centre + steps @ found[0], scale * found[1])

    def _answer(self, thrusts: np.ndarray, slack: np.ndarray, multipliers: np.ndarray) -> AcceptedSolution:
        parts = (self._first, *self._parts)
        exact = any(part.outcome is Outcome.EXACT_FALLBACK for part in parts)
        self._limited = bool(np.abs(multipliers).max(initial=0.0) > ACTIVE_MULTIPLIER)
        return AcceptedSolution(
            thrusts=np.clip(thrusts, self._lower, self._upper),
            x=np.concatenate((thrusts, slack)),
            y=multipliers,
            outcome=Outcome.EXACT_FALLBACK if exact else Outcome.SOLVED,
            iterations=sum(part.iterations for part in parts),
            seconds=sum(part.seconds for part in parts),
            limited=self._limited,
        )


class LexicographicController(HybridController):
    """`HybridController` without a trade between levels: the remainder of the cascade of `CascadeEngine`."""

    problem_kind = PriorityProblem
    engine_kind = CascadeEngine
