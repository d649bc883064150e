"""Program data through CasADi's buffer interface: nothing is allocated in the loop."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from ibvs_qp.model.bound_function import BoundFunction
from ibvs_qp.model.machine_code import machine_code
from ibvs_qp.qp.problem import QpTemplate


class BufferedFunction(BoundFunction):
    """A CasADi function bound to arrays of its own; calling it fills the output arrays in place.

    Attributes:
        inputs, outputs: The arrays, one per argument and result.
    """

    def __init__(self, function: ca.Function, to_machine_code: bool = False) -> None:
        if to_machine_code:
            function = machine_code(function)
        self.inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self.outputs = [np.zeros(function.numel_out(i)) for i in range(function.n_out())]
        super().__init__(function, self.inputs, self.outputs)


class ProgramData:
    """Values of one tick's program, where the compiled tick leaves them.

    Attributes:
        p: Non-zeros of the upper triangle of P. Likewise q, a, lower, upper.
        stacked: Parameters of the program; `parameters` are views of it by name.
        free: Thrusts of the same tick without any limit [N], (n,).
        violation: By how much they break the worst row, (1,); < 0 where they are the solution, infinite where a number
            is missing.
    """

    def __init__(self, template: QpTemplate, arrays: Sequence[np.ndarray]) -> None:
        self.p, self.q, self.a, self.lower, self.upper, self.stacked, self.free, self.violation = arrays
        self.parameters = {name: self.stacked[place] for name, place in template.layout.items()}
        self._report = BufferedFunction(template.report)
        self._rotors = template.model.rotors
        pattern = template.p_pattern.tocoo()
        self._rows, self._columns = pattern.row, pattern.col
        pattern = template.a_pattern.tocoo()
        self._row_of, self._column_of = pattern.row, pattern.col
        self._size = len(template.variable_names)

    def evaluate(self) -> None:
        """Bring the data up to date with the parameters; the compiled tick has done so already."""

    def hessian(self) -> np.ndarray:
        """P in full, (variables, variables)."""
        full = np.zeros((self._size, self._size))
        full[self._rows, self._columns] = self.p
        full[self._columns, self._rows] = self.p
        return full

    def rows(self) -> np.ndarray:
        """A in full, (rows, variables)."""
        full = np.zeros((len(self.lower), self._size))
        full[self._row_of, self._column_of] = self.a
        return full

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
        self._values, self._free = BufferedFunction(template.values), BufferedFunction(template.free)
        super().__init__(template, [*self._values.outputs, self._values.inputs[0], *self._free.outputs])

    def evaluate(self) -> None:
        """Fill p, q, a, lower, upper and the free optimum from the parameters."""
        self._values()
        self._free.inputs[0][:] = self.stacked
        self._free()
