"""The compiled step: named arrays in, named arrays out, states carried from step to step."""

from __future__ import annotations

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from ibvs_qp.symbolic.bound_function import BoundFunction
from ibvs_qp.symbolic.machine_code import machine_code
from ibvs_qp.symbolic.signals import Signals, places, stack


class StepFunction:
    """One CasADi function of all signals on arrays of its own.

    Attributes:
        inputs, states, outputs: Views by name; write inputs with ``[:] =``, outputs hold after `evaluate`.
        point: All inputs and states of the last evaluation in one column: together they reproduce the step.
        results: All outputs in one column; starts: place of the first entry of each.
        size: Numbers in all of them.
        extra: Arrays of the additional results, in their order.
    """

    def __init__(self, signals: Signals, extra: Sequence[ca.SX] = (), to_machine_code: bool = False) -> None:
        next_states = ca.densify(signals.next_states)
        results = [next_states, ca.sum1(next_states), stack(signals.outputs), *(ca.densify(entry) for entry in extra)]
        function = ca.Function("step", [stack(signals.inputs), stack(signals.states)], ca.cse(results))
        if to_machine_code:
            function = machine_code(function)
        count = function.numel_in(0)
        self.point = np.zeros(count + function.numel_in(1))
        self.values, self._state = self.point[:count], self.point[count:]
        arrays = [np.zeros(function.numel_out(index)) for index in range(function.n_out())]
        self._next, self._sum, self.results, *self.extra = arrays
        self._bound = BoundFunction(function, [self.values, self._state], arrays)
        self.evaluate = self._bound.evaluate
        self.inputs = {name: self.values[place] for name, place in places(signals.inputs).items()}
        self.states = {name: self._state[place] for name, place in places(signals.states).items()}
        self.outputs = {name: self.results[place] for name, place in places(signals.outputs).items()}
        self.starts = {name: place.start for name, place in places(signals.outputs).items()}
        self._start = np.concatenate([*signals.starts.values(), np.zeros(0)])
        self.size = sum(array.size for array in self.save_memory())
        self.reset()

    def reset(self) -> None:
        """Set the states to their start values."""
        self._state[:] = self._next[:] = self._start
        self._sum[0] = 0.0

    def save_memory(self) -> list[np.ndarray]:
        """State of a flight: of the memory that the function is bound to."""
        return [self.point, self._next, self._sum, self.results, *self.extra]

    def load_memory(self, values: list[np.ndarray]) -> None:
        """Continue from a state."""
        for own, value in zip(self.save_memory(), values, strict=True):
            own[:] = value

    def advance(self) -> None:
        """Move on to the states that the last evaluation computed; they stay where one of them is not finite."""
        if math.isfinite(self._sum[0]):
            self._state[:] = self._next
