"""CasADi functions on numpy arrays: bound to fixed memory for every tick, or from arrays to arrays."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np


class BoundFunction:
    """A function bound to the memory of its arguments and results; nothing is copied or allocated in a call.

    Attributes:
        evaluate: The same as calling it, half as long for what runs every tick.

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
    """A CasADi function from arrays to arrays, for what is evaluated now and then."""

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
