"""Program data through CasADi's buffer interface: nothing is allocated in the loop."""

from __future__ import annotations

from collections.abc import Sequence

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


class ProgramData:
    """Values of one tick's program, where the compiled tick leaves them.

    Attributes:
        p: Non-zeros of the upper triangle of P. Likewise q, a, lower, upper.
        stacked: Parameters of the program; `parameters` are views of it by name.
    """

    def __init__(self, template: QpTemplate, arrays: Sequence[np.ndarray]) -> None:
        self.p, self.q, self.a, self.lower, self.upper, self.stacked = arrays
        self.parameters = {name: self.stacked[place] for name, place in template.layout.items()}
        self._report = BufferedFunction(template.report)
        self._rotors = template.model.rotors
        pattern = template.p_pattern.tocoo()
        self._rows, self._columns = pattern.row, pattern.col
        self._size = len(template.variable_names)

    def evaluate(self) -> None:
        """Bring the data up to date with the parameters; the compiled tick has done so already."""

    def hessian(self) -> np.ndarray:
        """P in full, (variables, variables)."""
        full = np.zeros((self._size, self._size))
        full[self._rows, self._columns] = self.p
        full[self._columns, self._rows] = self.p
        return full

    def unlimited_thrusts(self) -> np.ndarray:
        """Thrusts of the same tick without any limit [N], (n,): slacks are free then and the thrusts decouple."""
        n = self._rotors
        return -np.linalg.solve(self.hessian()[:n, :n], self.q[:n])

    def report(self, stacked: np.ndarray, thrusts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Achieved and asked values and weights of every task row at given parameters and thrusts."""
        self._report.inputs[0][:] = stacked
        self._report.inputs[1][:] = thrusts
        self._report()
        achieved, asked, weights = self._report.outputs
        return achieved, asked, weights


class Evaluator(ProgramData):
    """A program on its own: write `parameters` with ``[name][:] =``, evaluate, read the data."""

    def __init__(self, template: QpTemplate) -> None:
        self._values = BufferedFunction(template.values)
        super().__init__(template, [*self._values.outputs, self._values.inputs[0]])

    def evaluate(self) -> None:
        """Fill p, q, a, lower and upper from the parameters."""
        self._values()
