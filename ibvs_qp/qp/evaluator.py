"""Values of one step's program, in flight or from a recorded step."""

from __future__ import annotations

import numpy as np

from ibvs_qp.qp.problem import QpProblem
from ibvs_qp.symbolic.step_function import StepFunction


class ProgramData:
    """Values of one step's program, where the step function writes them.

    Attributes:
        p: Non-zeros of the upper triangle of P. Likewise q, a, lower, upper.
        unlimited: Solution of the same program without any row of A, (variables,).
        free: Thrusts without limits [N], (n,): `unlimited` before noise at the limits is clipped.
        further: Further values of the problem, in their order.
        point: Inputs and states of the step; `inputs` are views of it by name.
    """

    def __init__(self, problem: QpProblem, step: StepFunction) -> None:
        self.p, self.q, self.a, self.lower, self.upper, self.unlimited, self.free, *self.further = step.extra
        self._step = step  # owns the memory that the compiled function writes
        self.point, self.inputs = step.point, step.inputs
        self._problem = problem
        pattern = problem.p_pattern.tocoo()
        self._rows, self._columns = pattern.row, pattern.col
        pattern = problem.a_pattern.tocoo()
        self._row_of, self._column_of = pattern.row, pattern.col
        self._size = len(problem.variable_names)

    @property
    def beyond_limits(self) -> bool:
        """Whether the thrusts without limits pass a thrust limit, by noise or by more."""
        n = len(self.free)
        return bool((self.free < self.lower[:n]).any() or (self.free > self.upper[:n]).any())

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

    def limit_values(self, thrusts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Value, lower and upper bound of every limit row at given thrusts, in the row's own unit."""
        value, lower, upper = self._problem.limit_values(self.point, thrusts)
        return value, lower, upper


class RecordedProgram(ProgramData):
    """The program of recorded steps: set `point`, evaluate, read the values."""

    def __init__(self, problem: QpProblem) -> None:
        step = StepFunction(problem.model.signals, problem.values)
        super().__init__(problem, step)
        self.evaluate = step.evaluate
