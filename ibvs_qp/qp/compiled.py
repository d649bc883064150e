"""OSQP and its acceptance test in generated C code: the solver of the exported library, called from Python."""

from __future__ import annotations

import ctypes
import logging
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.problem import ProgramData, QpProblem
from ibvs_qp.qp.program_code import write_program
from ibvs_qp.qp.solver import AcceptedSolution, Tried
from ibvs_qp.symbolic.machine_code import cache_folder, compiler, shared_library

#: How the code is translated: no contraction of products and sums, so the same bits as OSQP's Python extension.
FLAGS = ("-std=c11", "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-w")
#: By ``ibvs_outcome``; the last, refined on the active set, is for targets without DAQP.
OUTCOMES = (Outcome.SOLVED, Outcome.INACCURATE_ACCEPTED, Outcome.CAPPED_ACCEPTED)

log = logging.getLogger(__name__)


class CompiledSolver:
    """OSQP with one workspace for all ticks; see `ibvs_qp.qp.solvers.osqp` and ``ibvs_qp/qp/c/solve.c``.

    Args:
        code: The shared library of `solver_library`.
        data: Values of the program, where the step function writes them.
        rotors: Thrusts among the variables.
    """

    def __init__(self, code: ctypes.CDLL, data: ProgramData, rotors: int) -> None:
        self._code = code
        self._code.ibvs_solve_values.restype, self._code.ibvs_step_size.restype = ctypes.c_bool, ctypes.c_double
        values = data.p, data.q, data.a, data.lower, data.upper, data.unlimited
        variables, rows = len(data.q), len(data.lower)
        self._memory = np.zeros(-(-self._code.ibvs_program_size() // 8))
        self._program = ctypes.c_void_p(self._memory.ctypes.data)
        numbers = rotors + variables + rows
        self._solution = np.zeros(numbers + 2)  # then outcome, iterations, limited
        self._thrusts, self._x, self._y = np.split(self._solution[:numbers], (rotors, rotors + variables))
        self._facts = self._solution[numbers:].view(np.int32)
        self._data = data  # owns the arrays at these addresses
        self._addresses = (ctypes.c_void_p * len(values))(*(array.ctypes.data for array in values))
        self._found = ctypes.c_void_p(self._solution.ctypes.data)
        self.reset()

    def reset(self) -> None:
        """Drop the iterate and the adapted step size: the next solve is as after construction."""
        self._code.ibvs_program_reset(self._program)
        self._start: np.ndarray | None = None  # x, y and step size from which the next solve sets up anew

    def save_memory(self) -> np.ndarray | None:
        """State of a flight, as of `OsqpSolver`."""
        if step_size := self._code.ibvs_step_size(self._program):
            self._code.ibvs_program_reset(self._program)
            self._start = np.concatenate((self._x, self._y, (step_size,)))
        return self._start

    def load_memory(self, start: np.ndarray | None) -> None:
        """Continue from a state."""
        self.reset()
        self._start = start

    def solve(self) -> tuple[AcceptedSolution | None, Tried | None]:
        """Solve the program of this tick; None if OSQP's solution is not accepted or the data is not finite."""
        start = time.perf_counter()
        begin = None if self._start is None else ctypes.c_void_p(self._start.ctypes.data)
        solved = self._code.ibvs_solve_values(self._program, self._addresses, begin, self._found)
        seconds = time.perf_counter() - start
        outcome, iterations, limited, _ = self._facts.tolist()
        tried = Tried(iterations, seconds) if iterations >= 0 else None
        self._start = self._start if tried is None else None
        if not solved or outcome >= len(OUTCOMES):
            return None, tried
        thrusts, x, y = self._thrusts.copy(), self._x.copy(), self._y.copy()
        return AcceptedSolution(thrusts, x, y, OUTCOMES[outcome], iterations, seconds, bool(limited & 1)), tried

    def warm_start(self, x: np.ndarray, y: np.ndarray) -> None:
        """Replace the iterate."""
        self._x[:], self._y[:] = x, y
        x_address, y_address = (ctypes.c_void_p(array.ctypes.data) for array in (self._x, self._y))
        self._code.ibvs_warm_start(self._program, x_address, y_address)


def compiled_solver(problem: QpProblem, settings: SolverSettings, data: ProgramData) -> CompiledSolver | None:
    """The compiled solver of a program; None, and one line in the log, where no compiler makes it."""
    command = compiler()
    if command is None:
        log.info("no C compiler: OSQP runs in its Python extension")
        return None
    try:
        key = ("solver", settings, *command, str(cache_folder()))
        code = problem.model.built(key, lambda: ctypes.CDLL(str(solver_library(problem, settings, command))))
        return CompiledSolver(code, data, problem.model.rotors)
    except (OSError, subprocess.SubprocessError) as error:
        log.warning("OSQP runs in its Python extension: %s", error)
        return None


def solver_library(problem: QpProblem, settings: SolverSettings, command: list[str]) -> Path:
    """Shared library of a program's solver, from the cache if it was compiled before."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        write_program(folder, problem, settings)
        sources = {file.name: file.read_text() for file in sorted(folder.rglob("*.[ch]"))}
    return shared_library("solver", sources, command, FLAGS)
