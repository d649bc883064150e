"""Parameters to program data, through CasADi's buffer interface: nothing is allocated in the loop."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.qp.assembly import QpTemplate


class BufferedFunction:
    """A CasADi function bound to owned contiguous arrays; calling it fills the output arrays in place."""

    def __init__(self, function: ca.Function) -> None:
        self._buffer, self._trigger = function.buffer()
        self.inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self.outputs = [np.zeros(function.numel_out(i)) for i in range(function.n_out())]
        for index, array in enumerate(self.inputs):
            self._buffer.set_arg(index, memoryview(array))  # type: ignore[arg-type, call-arg]
        for index, array in enumerate(self.outputs):
            self._buffer.set_res(index, memoryview(array))  # type: ignore[arg-type, call-arg]
        self._function = function  # the buffer does not keep the function alive

    def __call__(self) -> None:
        """Evaluate on the present inputs."""
        self._trigger()


class Evaluator:
    """Named parameters in, program data out.

    Attributes:
        parameters: Views into the stacked parameter vector, by name; write values with ``[:] =``.
        p: Non-zeros of the upper triangle of P. Likewise q, a, lower, upper.
    """

    def __init__(self, template: QpTemplate) -> None:
        self._values = BufferedFunction(template.values)
        self._report = BufferedFunction(template.report)
        self.stacked = self._values.inputs[0]
        self.parameters = {name: self.stacked[place] for name, place in template.layout.items()}
        self.p, self.q, self.a, self.lower, self.upper = self._values.outputs

    def evaluate(self) -> None:
        """Fill p, q, a, lower and upper from the parameters."""
        self._values()

    def report(self, stacked: np.ndarray, thrusts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Achieved and asked values and weights of every task row at given parameters and thrusts."""
        self._report.inputs[0][:] = stacked
        self._report.inputs[1][:] = thrusts
        self._report()
        achieved, asked, weights = self._report.outputs
        return achieved, asked, weights
