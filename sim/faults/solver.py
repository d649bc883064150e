"""Faults of the solution of the quadratic program; the analytic law has none."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.pilot import Pilot
from sim.faults.fault import Fault, Surroundings

#: By this much the lower bound of a thrust is above its upper bound in a contradictory program [N].
CONTRADICTION_N = 5.0


def qp_engine(pilot: Pilot) -> Any:
    """The engine of the pilot's QP law.

    Raises:
        ConfigError: When the pilot has another law.
    """
    engine = getattr(pilot.controller, "engine", None)
    if engine is None:
        raise ConfigError("a fault of the solver needs the QP law")
    return engine


@dataclass(frozen=True, kw_only=True)
class SolverFault(Fault):
    """A fault of every solve."""

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Replace the engine's method by another one, on this object alone."""
        engine = qp_engine(pilot)
        engine.solve = self.solution(engine, engine.solve)
        return self.words

    def end(self, world: Surroundings, pilot: Pilot) -> None:
        """The engine's own method again."""
        del qp_engine(pilot).solve

    @abstractmethod
    def solution(self, engine: Any, solve: Callable[[], Any]) -> Callable[[], Any]:
        """Function in place of ``solve``."""


@dataclass(frozen=True, kw_only=True)
class SolverSilent(SolverFault):
    """Neither OSQP nor DAQP finds a solution."""

    def solution(self, engine: Any, solve: Callable[[], Any]) -> Callable[[], Any]:
        """None, as after a failure of both."""

        def nothing() -> None:
            engine.reset()

        return nothing


@dataclass(frozen=True, kw_only=True)
class SolverInfeasible(SolverFault):
    """The program contradicts itself."""

    def solution(self, engine: Any, solve: Callable[[], Any]) -> Callable[[], Any]:
        """Solve it with crossed bounds of the first thrust."""

        def contradicted() -> Any:
            engine.data.lower[0] = engine.data.upper[0] + CONTRADICTION_N
            return solve()

        return contradicted
