"""CasADi functions on numpy arrays: bound to fixed memory for every tick, from arrays to arrays, or with states."""

from __future__ import annotations

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from ibvs_qp.symbolic.machine_code import machine_code
from ibvs_qp.symbolic.signals import Signals, places, stack


class BoundFunction:
    """A function bound to the memory of its arguments and results; nothing is copied or allocated in a call.

    Attributes:
        evaluate: The same as calling it in half the time, for functions of every tick.

    Args:
        function: The function; may be shared by any number of bindings.
        arguments: One contiguous float64 array per input, matrices in column order.
        results: Likewise per output.

    Raises:
        ValueError: When an array has another size than the function's argument or result.
    """

    def __init__(self, function: ca.Function, arguments: Sequence[np.ndarray], results: Sequence[np.ndarray]) -> None:
        sizes_in = [function.numel_in(index) for index in range(function.n_in())]
        sizes_out = [function.numel_out(index) for index in range(function.n_out())]
        if [array.size for array in (*arguments, *results)] != sizes_in + sizes_out:
            raise ValueError(f"{function.name()}: arrays of {sizes_in} and {sizes_out} numbers needed")
        buffer, self.evaluate = function.buffer()
        for index, array in enumerate(arguments):
            buffer.set_arg(index, _memory(array))  # type: ignore[arg-type, call-arg]
        for index, array in enumerate(results):
            buffer.set_res(index, _memory(array))  # type: ignore[arg-type, call-arg]
        # the buffer keeps neither the function nor the arrays alive
        self._alive = function, buffer, tuple(arguments), tuple(results)

    def __call__(self) -> None:
        """Evaluate on the present arguments."""
        self.evaluate()


class ArrayFunction:
    """A CasADi function from arrays to arrays, for occasional evaluation."""

    def __init__(self, name: str, arguments: list[ca.SX], results: list[ca.SX]) -> None:
        self._function = ca.Function(name, arguments, results)

    def __call__(self, *arguments: np.ndarray) -> list[np.ndarray]:
        """Evaluate on vectors; returns vectors."""
        return [np.array(value).ravel() for value in self._function(*arguments)]


def _memory(array: np.ndarray) -> memoryview:
    """The array's own memory; a strided or converted array would silently be a copy."""
    if array.dtype != np.float64 or not array.flags.c_contiguous:
        raise ValueError("a bound array must be contiguous float64")
    return memoryview(array.reshape(-1))  # type: ignore[arg-type]


class StepFunction:
    """One CasADi function of all signals on arrays of its own.

    Attributes:
        inputs, states, outputs: Views by name; write inputs with ``[:] =``, outputs hold after `evaluate`.
        point: All inputs and states of the last evaluation in one column: together they reproduce the step.
        memory: All numbers of the step; a copy of it restores an earlier step. Their number is ``size``.
        results: All outputs in one column; starts: place of the first entry of each.
        extra: Arrays of the additional results, in their order.

    Args:
        signals: The registry, complete.
        extra: Additional results.
        to_machine_code: Whether a compiler translates it.
        function: That of the same signals and results, complete, to spare its construction.
    """

    def __init__(
        self,
        signals: Signals,
        extra: Sequence[ca.SX] = (),
        to_machine_code: bool = False,
        function: ca.Function | None = None,
    ) -> None:
        function = function or step_function(signals, extra)
        if to_machine_code:
            function = machine_code(function)
        count, sizes = function.numel_in(0), [function.numel_out(index) for index in range(function.n_out())]
        ends = np.cumsum([count + function.numel_in(1), *sizes])
        self.memory = np.zeros(ends[-1])
        self.point, *arrays = np.split(self.memory, ends[:-1])
        self.values, self._state = self.point[:count], self.point[count:]
        self._next, self._sum, self.results, *self.extra = arrays
        self._bound = BoundFunction(function, [self.values, self._state], arrays)
        self.evaluate = self._bound.evaluate
        self.inputs = {name: self.values[place] for name, place in places(signals.inputs).items()}
        self.states = {name: self._state[place] for name, place in places(signals.states).items()}
        self.outputs = {name: self.results[place] for name, place in places(signals.outputs).items()}
        self.starts = {name: place.start for name, place in places(signals.outputs).items()}
        self._start = np.concatenate([*signals.starts.values(), np.zeros(0)])
        self.size = self.memory.size
        self.reset()

    def reset(self) -> None:
        """Set the states to their start values."""
        self._state[:] = self._next[:] = self._start
        self._sum[0] = 0.0

    def save_memory(self) -> np.ndarray:
        """State of a flight: the memory that the function is bound to."""
        return self.memory

    def load_memory(self, values: np.ndarray) -> None:
        """Continue from a state."""
        self.memory[:] = values

    def advance(self) -> None:
        """Move on to the states that the last evaluation computed; they stay where one of them is not finite."""
        if math.isfinite(self._sum[0]):
            self._state[:] = self._next


def step_function(signals: Signals, extra: Sequence[ca.SX] = ()) -> ca.Function:
    """Inputs and states to next states, their sum, outputs, and additional results, each in one column."""
    next_states = ca.densify(signals.next_states)
    results = [next_states, ca.sum1(next_states), stack(signals.outputs), *(ca.densify(entry) for entry in extra)]
    return ca.Function("step", [stack(signals.inputs), stack(signals.states)], ca.cse(results))
