"""Values of one step's program, in flight or from a recorded step."""

from __future__ import annotations

import numpy as np

from ibvs_qp.model.bound_function import BoundFunction
from ibvs_qp.model.machine_code import machine_code
from ibvs_qp.model.step_function import StepFunction
from ibvs_qp.qp.problem import QpProblem


class ProgramData:
    """Values of one step's program, where the step function writes them.

    Attributes:
        p: Non-zeros of the upper triangle of P. Likewise q, a, lower, upper.
        free: Thrusts of the same step without any limit [N], (n,).
        point: Inputs and states of the step; `inputs` are views of it by name.
    """

    def __init__(self, problem: QpProblem, step: StepFunction, to_machine_code: bool = False) -> None:
        self.p, self.q, self.a, self.lower, self.upper, self.free = step.extra
        self._step = step  # owns the memory that the compiled function writes
        self.point, self.inputs = step.point, step.inputs
        report, inputs = machine_code(problem.report) if to_machine_code else problem.report, len(step.values)
        self._problem, self._inputs = problem, inputs
        self._point, self._thrusts = np.zeros(len(step.point)), np.zeros(problem.model.rotors)
        self._rows_reported = [np.zeros(report.numel_out(index)) for index in range(report.n_out())]
        arguments = [self._point[:inputs], self._point[inputs:], self._thrusts]
        self._report = BoundFunction(report, arguments, self._rows_reported)
        pattern = problem.p_pattern.tocoo()
        self._rows, self._columns = pattern.row, pattern.col
        pattern = problem.a_pattern.tocoo()
        self._row_of, self._column_of = pattern.row, pattern.col
        self._size = len(problem.variable_names)

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
        at = self._problem.limit_values(self.point[: self._inputs], self.point[self._inputs :], thrusts)
        value, lower, upper = (np.array(entry).ravel() for entry in at)
        return value, lower, upper

    def report(self, point: np.ndarray, thrusts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Achieved and target values and weights of every task row at the inputs and states of a step."""
        self._point[:], self._thrusts[:] = point, thrusts
        self._report()
        achieved, targets, weights = self._rows_reported
        return achieved, targets, weights


class RecordedProgram(ProgramData):
    """The program of recorded steps: set `point`, evaluate, read the values."""

    def __init__(self, problem: QpProblem) -> None:
        step = StepFunction(problem.model.signals, problem.values)
        super().__init__(problem, step)
        self.evaluate = step.evaluate
