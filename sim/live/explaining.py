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
#: Bounds that differ by less are equal [N].
_ROUNDING_N = 1e-6
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
        tick_s: Time of a tick [s].
        rotors: Names of the rotors.
        names: Values that `scaled` changes: the ceiling of thrusts, weights, and limits but their switches.

    Args:
        config: The controller flown; only its structure matters, weights and bounds are inputs of a tick.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self._problem = _problem(equations(config))
        self._replay, self._replaying = TickReplay(self._problem), threading.Lock()  # it has one buffer
        self._places = places(self._problem.model.signals.inputs)
        self.vehicle, self.tick_s = self._problem.model.config.vehicle, config.tick_s
        self.rotors = self.vehicle.geometry.names
        numbers = (name for name, value in setting_values(config).items() if not isinstance(value, bool))
        self.names = (CEILING, *(name for name in numbers if name.startswith(("weights.", "limits."))))

    def settings(self, point: np.ndarray) -> dict[str, float]:
        """Gains, weights and limits in a recorded tick, by their names."""
        names = (f"{section}.{name}" for section, fields in RUN_TIME.items() for name in fields)
        return {name: float(point[self._places[name]][0]) for name in names if name in self._places}

    def limits(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper thrust limits in force in a recorded tick [N], (n,) each."""
        high = np.minimum(point[self._places["thrust_high"]], point[self._places[CEILING]])
        return point[self._places["thrust_low"]], high

    def ceiling(self, point: np.ndarray) -> float:
        """Upper thrust limit in force of a sound rotor in a recorded tick [N]."""
        return float(self.limits(point)[1].max())

    def explain(self, point: np.ndarray, values: Mapping[str, float] | None = None) -> Explanation | None:
        """Solve a recorded tick with other values of some settings; None without a solution.

        Args:
            point: Inputs and states of the tick, (P,).
            values: By name, as for `CheckedLaw.adjust`, or `CEILING` for the upper limit of all rotors [N]; a lost
                or weak rotor keeps its own, lower one.

        Raises:
            ConfigError: When a name is no input of the program, or a value is refused.
        """
        changed = np.array(point, float)
        for name, value in (values or {}).items():
            if name not in self._places:
                raise ConfigError(f"{name} is no input of the program")
            if not np.isfinite(value):
                raise out_of_range(name, value, "", "a finite number is needed")
            if name == CEILING:
                upper, high = self.limits(point)[1], changed[self._places["thrust_high"]]
                value = np.where(upper > upper.max() - _ROUNDING_N, value, np.minimum(upper, value))
                changed[self._places["thrust_high"]] = np.maximum(high, value)
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

    def markdown(self, point: np.ndarray, found: Explanation | None, before: Explanation | None = None) -> str:
        """Explanation of a tick: thrusts, tasks with their fractions of the cost, prices of limits, lost wrench.

        Args:
            point: Inputs and states of the tick, (P,).
            found: With other values.
            before: As recorded.
        """
        last, step = (point[self._places[name]] for name in ("thrust_last", "thrust_step"))
        steps = {f"thrust_{name}": (last[index] - step, last[index] + step) for index, name in enumerate(self.rotors)}
        return _markdown(found, before, self.rotors, steps)


def _markdown(
    found: Explanation | None,
    before: Explanation | None,
    rotors: tuple[str, ...],
    steps: Mapping[str, tuple[np.ndarray, np.ndarray]],
) -> str:
    if found is None:
        return "No thrusts satisfy the hard limits of this tick together."
    flown = before or found
    changes = [f"{value - was:+.2f}" for value, was in zip(found.thrusts, flown.thrusts, strict=True)]
    thrusts = [(name, f"{was:.2f}", f"{value:.2f}", change) for name, was, value, change in
               zip(rotors, flown.thrusts, found.thrusts, changes, strict=True)]  # fmt: skip
    lines = [table(("rotor", "flown N", "now N", "change N"), thrusts)]
    tasks = [(f"{name} {unit}", *numbers) for name, unit, *numbers in task_rows(found)]
    lines.append(table(("task", *TASK_HEADINGS[2:]), tasks))
    prices = {limit.name: limit.price for limit in flown.active_limits}
    limits = []
    for limit, row, span in zip(found.active_limits, found.limit_rows, found.limit_ranges, strict=True):
        bound = row.upper if limit.side == "upper" else row.lower
        rated = any(abs(bound - end) < _ROUNDING_N for end in steps.get(limit.name, ()))
        side = "rate limit" if rated else limit.side
        slack = f" + slack {limit.slack:.2g}" if limit.slack > 0.0 else ""
        limits.append((
            limit.name, f"{side} {bound:.4g}{slack} {limit.unit}",
            f"{prices.get(limit.name, 0.0):.3g}", f"{limit.price:.3g}",
            f"{span.change_low:+.2g} to {span.change_high:+.2g}, {span.until}",
        ))  # fmt: skip
    headings = ("limit", "at", "price flown", "now", "holds for changes of")
    lines.append(table(headings, limits) if limits else "No limit is active.")
    gone = [name for name in prices if name not in {limit.name for limit in found.active_limits}]
    if gone:
        lines.append(f"No longer active: {', '.join(gone)}.")
    lost = [f"{value:+.3f} {axis}" for axis, value in zip(_AXES, found.unallocated_wrench, strict=True)
            if abs(value) > _NOTHING]  # fmt: skip
    lines.append(f"Unallocated: {', '.join(lost)}." if lost else "The whole wrench is allocated.")
    return "\n\n".join(lines)
