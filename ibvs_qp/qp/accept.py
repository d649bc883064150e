"""Which solution may fly: status first, then finiteness, then bounds and residuals."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.active_set import ActiveSet
from ibvs_qp.qp.evaluator import ProgramData
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.infeasible import conflicting_rows
from ibvs_qp.qp.osqp import MAX_ITERATIONS, SOLVED, SOLVED_INACCURATE, OsqpSolver, RawSolution
from ibvs_qp.qp.problem import QpProblem

#: Status values whose iterate means something.
USABLE = (SOLVED, SOLVED_INACCURATE, MAX_ITERATIONS)
#: A multiplier above this price counts as an active limit [cost per unit].
ACTIVE_PRICE = 1e-3
#: Largest violation of a hard row in a solved program [N of thrust]; that of a thrust is clipped away.
BOUND_SLIP = 1e-2

#: An enumeration's member is looked up by name; every tick ends with this one.
_SOLVED = Outcome.SOLVED


@dataclass(slots=True)
class AcceptedSolution:
    """Thrusts within their bounds, the full primal and dual vectors, how they were found, and whether a row binds."""

    thrusts: np.ndarray
    x: np.ndarray
    y: np.ndarray
    outcome: Outcome
    iterations: int
    seconds: float
    limited: bool = True


class QpEngine:
    """OSQP behind an acceptance test, its active rows solved exactly, DAQP behind OSQP.

    An infeasible solve of OSQP returns x = 2143289344.0, a finite number: only the status tells. A capped solve is
    accepted when its residuals are small enough to fly; otherwise the exact solver answers in the same tick.

    Attributes:
        data: Data of the program; on its own an `Evaluator` whose parameters are yours to write.
        conflict: Names of a smallest set of hard rows that contradict each other, after a solve that found nothing.
    """

    def __init__(
        self,
        template: QpProblem,
        settings: SolverSettings,
        data: ProgramData,
        to_machine_code: bool = False,
    ) -> None:
        self.template, self.settings, self.data = template, settings, data
        self.osqp = OsqpSolver(template, settings)
        self.active_set = ActiveSet(template, to_machine_code)
        self.exact = ExactSolver(template)
        self._matrix = template.a_pattern.copy()
        self._rotors = template.model.rotors
        self._hard = np.flatnonzero(template.row_slack[self._rotors :] < 0) + self._rotors
        self.conflict: tuple[str, ...] = ()
        self._no_slack = np.zeros(len(template.variable_names))
        self._no_price = np.zeros(len(template.row_names))

    def reset(self) -> None:
        """As after construction."""
        self.osqp.reset()
        self.active_set.reset()

    def solve(self) -> AcceptedSolution | None:
        """Solve the program as its data stands; None when nobody found a solution."""
        data, self.conflict = self.data, ()
        known = self._without_iterating() if self.settings.shortcut and self.osqp.ready else None
        if known is not None:
            return known
        raw = self.osqp.solve(data.p, data.q, data.a, data.lower, data.upper)
        if raw is None:
            return None
        outcome = self._judge(raw.status, raw.x, raw.y)
        exact = self._exact_by_active_rows(raw, outcome)
        if exact is not None:
            return self._accept(*exact, Outcome.SOLVED, raw.iterations, raw.seconds)
        if outcome is not None:
            return self._accept(raw.x, raw.y, outcome, raw.iterations, raw.seconds)
        exact = self.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
        if exact is None:
            self.conflict = conflicting_rows(self.template, data)
            self.osqp.reset()
            return None
        self.osqp.warm_start(*exact)
        return self._accept(*exact, Outcome.EXACT_FALLBACK, raw.iterations, raw.seconds)

    def _exact_by_active_rows(self, raw: RawSolution, outcome: Outcome | None) -> tuple[np.ndarray, np.ndarray] | None:
        """The exact solution from OSQP's guess of the active rows, where it stopped early or rows bind."""
        if not self.settings.polish or raw.status not in USABLE or not math.isfinite(raw.x.sum() + raw.y.sum()):
            return None
        if outcome is Outcome.SOLVED and float(np.abs(raw.y).max()) <= ACTIVE_PRICE:
            return None
        return self.active_set.solve_near(self.data, raw.x, raw.y)

    def _without_iterating(self) -> AcceptedSolution | None:
        """The solution where no row binds, or the rows of the last tick do; nothing is left for iterations to find."""
        data = self.data
        violation = data.violation.item(0)
        # A violation steps over a thrust that is no number, so the thrusts are asked themselves.
        if not (violation < math.inf and math.isfinite(sum(data.free.tolist()))):
            return None
        if violation <= 0.0:
            x = self._no_slack.copy()
            thrusts = x[: self._rotors]
            thrusts[:] = data.free
            return AcceptedSolution(thrusts, x, self._no_price, _SOLVED, 0, 0.0, False)
        exact = self.active_set.solve(data)
        return None if exact is None else self._accept(*exact, Outcome.SOLVED, 0, 0.0)

    def _judge(self, status: int, x: np.ndarray, y: np.ndarray) -> Outcome | None:
        if status not in USABLE or not math.isfinite(x.sum() + y.sum()):
            return None
        n, data = self._rotors, self.data
        bounds = zip(x[:n].tolist(), data.lower[:n].tolist(), data.upper[:n].tolist(), strict=True)
        slip = max(max(low - thrust, thrust - high) for thrust, low, high in bounds)
        if len(self._hard):
            slip = max(slip, self._hard_slip(x))
        if status == SOLVED:
            return Outcome.SOLVED if slip <= BOUND_SLIP else None
        if slip > self.settings.accept_residual or self.dual_residual(x, y) > self.settings.accept_residual:
            return None
        return Outcome.INACCURATE_ACCEPTED if status == SOLVED_INACCURATE else Outcome.CAPPED_ACCEPTED

    def _hard_slip(self, x: np.ndarray) -> float:
        """How far the thrusts lie beyond the hard rows that are not the thrusts themselves [N]."""
        data, hard = self.data, self._hard
        rows = data.rows()[hard, : self._rotors]
        at, newton = rows @ x[: self._rotors], np.linalg.norm(rows, axis=1)
        beyond = np.maximum(data.lower[hard] - at, at - data.upper[hard])
        return float((beyond / np.where(newton > 0.0, newton, 1.0)).max())

    def dual_residual(self, x: np.ndarray, y: np.ndarray) -> float:
        """Largest entry of P^-1 (P x + q + A' y): the thrust error that the residual stands for [N].

        Dividing by the diagonal of P instead would hide errors along weak directions, thousands of times softer.
        """
        data = self.data
        self._matrix.data[:] = data.a
        return float(np.abs(x + np.linalg.solve(data.hessian(), data.q + self._matrix.T @ y)).max())

    def _accept(
        self, x: np.ndarray, y: np.ndarray, outcome: Outcome, iterations: int, seconds: float
    ) -> AcceptedSolution:
        n, data = self._rotors, self.data
        thrusts = np.minimum(np.maximum(x[:n], data.lower[:n]), data.upper[:n])
        limited = max(map(abs, y.tolist())) > ACTIVE_PRICE
        return AcceptedSolution(thrusts, x, y, outcome, iterations, seconds, limited)
