"""Output of a controller: rotor thrusts and their explanation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np


class Outcome(StrEnum):
    """Exit of a step: the solver or law that found the command."""

    SOLVED = "solved"
    INACCURATE_ACCEPTED = "inaccurate_accepted"
    CAPPED_ACCEPTED = "capped_accepted"
    EXACT_FALLBACK = "exact_fallback"
    ANALYTIC_FALLBACK = "analytic_fallback"
    HOLD = "hold"


class SafetyState(StrEnum):
    """State of the supervisor (`ibvs_qp.supervision`), in the order of severity."""

    NOMINAL = "nominal"
    DEGRADED = "degraded"
    RETREAT = "retreat"
    HOVER = "hover"
    DESCEND = "descend"
    TERMINATED = "terminated"


@dataclass(frozen=True, kw_only=True)
class TaskReport:
    """Target, achieved value and residual of one task row, in the task's own unit."""

    name: str
    unit: str
    weight: float
    asked: float
    achieved: float
    residual: float


@dataclass(frozen=True, eq=False)
class TaskReports(Sequence[TaskReport]):
    """Reports of the task rows with a weight; evaluated when read, because few ticks are.

    Attributes:
        rows: Name and unit of every task row.
        values: Function of point and thrusts: achieved and target values and weights of all rows, (rows,) each.
        point: Inputs and states of the tick.
        thrusts: Commanded thrusts [N], (n,).
    """

    rows: tuple[tuple[str, str], ...]
    values: Callable[[np.ndarray, np.ndarray], Sequence[np.ndarray]]
    point: np.ndarray
    thrusts: np.ndarray

    @cached_property
    def _reports(self) -> tuple[TaskReport, ...]:
        achieved, targets, weights = (column.tolist() for column in self.values(self.point, self.thrusts))
        columns = zip(self.rows, weights, targets, achieved, strict=True)
        return tuple(
            TaskReport(name=name, unit=unit, weight=weight, asked=asked, achieved=value, residual=value - asked)
            for (name, unit), weight, asked, value in columns
            if weight > 0.0
        )

    def __len__(self) -> int:
        """Number of task rows with a weight."""
        return len(self._reports)

    def __getitem__(self, index: Any) -> Any:
        """One report, or a tuple of them."""
        return self._reports[index]

    def __eq__(self, other: object) -> bool:
        """Whether the reports are equal one by one."""
        return isinstance(other, Sequence) and self._reports == tuple(other)

    def __hash__(self) -> int:
        """Hash of the tuple of reports."""
        return hash(self._reports)


@dataclass(frozen=True, kw_only=True)
class ActiveLimit:
    """An active limit: its side ("lower" or "upper"), multiplier `|dJ*/d bound|` per unit as price, and slack taken."""

    name: str
    side: str
    price: float
    slack: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Command:
    """Rotor thrusts of one tick and why.

    Attributes:
        stamp_ns: Time of the measurement answered.
        thrusts: Commanded rotor thrusts [N], (n,), always finite and within the limits.
        wrench: B @ thrusts [N, N m], (6,); with a weak rotor, of the thrusts that the rotors give.
        outcome: How it was found.
        mode: Contact phase: "free", "approach", "contact" or "hold".
        rejected: Names of the inputs that were refused, with the reason.
        tasks: Task reports (QP law).
        active_limits: Active limits (QP law; clipped rotors for the analytic law).
        unallocated_wrench: Wrench of the same tick without limits minus the wrench [N, N m], (6,).
        reach_margin: Further push possible at the present contact [N], NaN if unknown.
        iterations: Solver iterations.
        solve_time_s: Wall-clock time of the solve [s].
        safety: State of the supervisor; nominal without one.
        safety_reasons: Why it is in that state; empty while nominal.
    """

    stamp_ns: int
    thrusts: np.ndarray
    wrench: np.ndarray
    outcome: Outcome
    mode: str
    rejected: tuple[str, ...] = ()
    tasks: Sequence[TaskReport] = ()
    active_limits: tuple[ActiveLimit, ...] = ()
    unallocated_wrench: np.ndarray
    reach_margin: float = float("nan")
    iterations: int = 0
    solve_time_s: float = 0.0
    safety: SafetyState = SafetyState.NOMINAL
    safety_reasons: tuple[str, ...] = ()
