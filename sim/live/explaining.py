"""Explanation of a tick: the recorded program solved again, as recorded and with other weights and bounds."""

from __future__ import annotations

import functools
import threading
from collections.abc import Mapping

import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.controller import qp_problem
from ibvs_qp.model.inputs import RUN_TIME, equations, setting_values
from ibvs_qp.qp.explain import Explanation, TickReplay
from ibvs_qp.qp.problem import QpProblem
from ibvs_qp.symbolic.signals import places
from sim.evaluate.explanation_text import TASK_HEADINGS, task_rows
from sim.evaluate.table import markdown as table

#: Upper thrust limit of all rotors, an input of the program.
CEILING = "thrust_ceiling"
#: Parts of a wrench, and their unit.
_AXES = ("front N", "right N", "down N", "roll N m", "pitch N m", "yaw N m")
#: Components of a wrench below this are not listed [N, N m].
_NOTHING = 5e-4


@functools.lru_cache(maxsize=2)
def _problem(config: ControllerConfig) -> QpProblem:
    return qp_problem(config)


class WhatIf:
    """Solves recorded ticks of one flight, as recorded and with other settings.

    Attributes:
        vehicle: The vehicle.
        rotors: Names of the rotors.
        names: Values that `scaled` changes: the ceiling of thrusts, weights, and limits but their switches.

    Args:
        config: The controller flown; only its structure matters, weights and bounds are inputs of a tick.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self._problem = _problem(equations(config))
        self._replay, self._replaying = TickReplay(self._problem), threading.Lock()  # it has one buffer
        self._places = places(self._problem.model.signals.inputs)
        self.vehicle = self._problem.model.config.vehicle
        self.rotors = self.vehicle.geometry.names
        numbers = (name for name, value in setting_values(config).items() if not isinstance(value, bool))
        self.names = (CEILING, *(name for name in numbers if name.startswith(("weights.", "limits."))))

    def settings(self, point: np.ndarray) -> dict[str, float]:
        """Gains, weights and limits in a recorded tick, by their names."""
        names = (f"{section}.{name}" for section, fields in RUN_TIME.items() for name in fields)
        return {name: float(point[self._places[name]][0]) for name in names if name in self._places}

    def ceiling(self, point: np.ndarray) -> float:
        """Smallest upper thrust limit in a recorded tick [N]."""
        return float(point[self._places[CEILING]].min())

    def explain(self, point: np.ndarray, values: Mapping[str, float] | None = None) -> Explanation | None:
        """Solve a recorded tick with other values of some settings; None without a solution.

        Args:
            point: Inputs and states of the tick, (P,).
            values: By name, as for `CheckedLaw.adjust`, or `CEILING` for the upper limit of all rotors [N].

        Raises:
            ConfigError: When a name is no input of the program, or a value is refused.
        """
        changed = np.array(point, float)
        for name, value in (values or {}).items():
            if name not in self._places:
                raise ConfigError(f"{name} is no input of the program")
            if not np.isfinite(value):
                raise out_of_range(name, value, "", "a finite number is needed")
            changed[self._places[name]] = value
        with self._replaying:
            return self._replay.explain(changed)

    def scaled(
        self, point: np.ndarray, name: str, factor: float
    ) -> tuple[float, Explanation | None, Explanation | None]:
        """Solve a recorded tick as recorded, and with one setting of `names` times a factor.

        Returns:
            The setting's value, and both explanations; None without a solution.

        Raises:
            ConfigError: When the value is refused.
        """
        flown = self.explain(point)
        own = self.ceiling(point) if name == CEILING else self.settings(point)[name]
        return factor * own, flown, flown if factor == 1.0 else self.explain(point, {name: factor * own})


def markdown(found: Explanation | None, before: Explanation | None, rotors: tuple[str, ...]) -> str:
    """Explanation of a tick: thrusts, tasks with their fractions of the cost, prices of limits, unallocated wrench.

    Args:
        found: With other values.
        before: As recorded.
        rotors: Names of the rotors.
    """
    if found is None:
        return "No thrusts satisfy the hard limits of this tick together."
    flown = before or found
    changes = [f"{value - was:+.2f}" for value, was in zip(found.thrusts, flown.thrusts, strict=True)]
    thrusts = [(name, f"{was:.2f}", f"{value:.2f}", change) for name, was, value, change in
               zip(rotors, flown.thrusts, found.thrusts, changes, strict=True)]  # fmt: skip
    lines = [table(("rotor", "flown N", "now N", "change N"), thrusts)]
    lines.append(table(TASK_HEADINGS, task_rows(found)))
    prices = {limit.name: limit.price for limit in flown.active_limits}
    limits = [
        (limit.name, limit.side, f"{row.value:.3g}", f"{prices.get(limit.name, 0.0):.3g}", f"{limit.price:.3g}",
         f"{span.change_low:+.3g} to {span.change_high:+.3g} {limit.unit}", span.until, f"{cost:.1%}")
        for limit, row, span, cost in zip(
            found.active_limits, found.limit_rows, found.limit_ranges, found.limit_cost, strict=True
        )
    ]  # fmt: skip
    headings = ("limit", "side", "value", "price flown", "price now", "holds for changes of", "until", "slack's share")
    lines.append(table(headings, limits) if limits else "No limit is active.")
    gone = [name for name in prices if name not in {limit.name for limit in found.active_limits}]
    if gone:
        lines.append(f"No longer active: {', '.join(gone)}.")
    lost = [f"{value:+.3f} {axis}" for axis, value in zip(_AXES, found.unallocated_wrench, strict=True)
            if abs(value) > _NOTHING]  # fmt: skip
    lines.append(f"Unallocated: {', '.join(lost)}." if lost else "The whole wrench is allocated.")
    return "\n\n".join(lines)
