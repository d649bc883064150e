"""What comes out: rotor thrusts and the explanation of how they came about."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from ibvs_qp.made import filled


class Outcome(StrEnum):
    """How a command was found; every exit of a step has one of these names."""

    SOLVED = "solved"
    INACCURATE_ACCEPTED = "inaccurate_accepted"
    CAPPED_ACCEPTED = "capped_accepted"
    EXACT_FALLBACK = "exact_fallback"
    ANALYTIC_FALLBACK = "analytic_fallback"
    HOLD = "hold"


@dataclass(frozen=True, kw_only=True)
class TaskReport:
    """What one task row asked for and got, in the task's own unit."""

    name: str
    unit: str
    weight: float
    asked: float
    achieved: float
    residual: float


@dataclass(frozen=True, kw_only=True)
class ActiveLimit:
    """A limit that binds: its side ("lower" or "upper"), price |dJ*/d bound| per unit, and slack taken."""

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
        thrusts: Wanted rotor thrusts [N], (n,), always finite and within the limits.
        wrench: B @ thrusts [N, N m], (6,).
        outcome: How it was found.
        mode: Contact phase: "free", "approach", "contact" or "hold".
        rejected: Names of the inputs that were refused, with the reason.
        tasks: Task reports (QP law).
        active_limits: Limits that bind (QP law; rotor boxes for the analytic law).
        unallocated_wrench: Wrench of the same tick without limits minus the wrench [N, N m], (6,).
        reach_margin: Further push possible at the present contact [N], NaN if unknown.
        iterations: Solver iterations.
        solve_time_s: Wall-clock time of the solve [s].
    """

    stamp_ns: int
    thrusts: np.ndarray
    wrench: np.ndarray
    outcome: Outcome
    mode: str
    rejected: tuple[str, ...] = ()
    tasks: tuple[TaskReport, ...] = field(default_factory=tuple)
    active_limits: tuple[ActiveLimit, ...] = field(default_factory=tuple)
    unallocated_wrench: np.ndarray
    reach_margin: float = float("nan")
    iterations: int = 0
    solve_time_s: float = 0.0

    @classmethod
    def explained_later(cls, explain: dict[str, Callable[[], Any]], fields: dict[str, Any]) -> Command:
        """A command some of whose fields are made when somebody reads them: the tick does not pay for them.

        Args:
            explain: What makes `wrench`, `tasks` and `active_limits`, or those of them that come later.
            fields: The other fields by name, all of them; the command keeps the dictionary.
        """
        fields["_explain"] = explain
        return filled(cls, fields)

    def __getattr__(self, name: str) -> Any:
        """Make what comes later at its first reading."""
        explain = self.__dict__.get("_explain", {})
        if name not in explain:
            raise AttributeError(name)
        self.__dict__[name] = value = explain[name]()
        return value

    def __getstate__(self) -> dict[str, Any]:
        """Pickle with everything made."""
        made = {name: getattr(self, name) for name in self.__dict__.get("_explain", ())}
        return {name: value for name, value in self.__dict__.items() if name != "_explain"} | made
