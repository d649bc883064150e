"""The C library of a configuration: generated tick, generated OSQP, and the shell that is the same for all."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

from ibvs_qp.config import ControllerConfig, EstimationConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import qp_problem
from ibvs_qp.interfaces.c_library.estimation_code import FROM_LAW, write_estimation
from ibvs_qp.interfaces.c_library.tables import write_layout, write_tables
from ibvs_qp.interfaces.c_library.tick_code import TickCode
from ibvs_qp.qp.program_code import write_program

#: The shell: code that is independent of the configuration.
SHELL = Path(__file__).parent / "c"
#: Entries of a wrench: with more rotors some changes of the thrusts leave it as it is.
WRENCH = 6
#: eps_abs and eps_rel of OSQP in single precision: with the tolerances of doubles every iteration ends at its bound.
#: Of ten pairs tried on 5,500 recorded ticks these leave the least error, 13 mN at most.
SINGLE_TOLERANCE, SINGLE_RELATIVE_TOLERANCE = 2e-3, 2e-6
#: Most iterations of OSQP in single precision: the active set is right by then, and exact from there on.
SINGLE_ITERATIONS = 20


def write_library(
    folder: Path, config: ControllerConfig, single: bool = False, estimation: EstimationConfig | None = None
) -> None:
    """Write the C library of a configuration.

    Args:
        folder: Empty or new folder.
        config: Vehicle, limits and weights are compiled in; the gains may be changed at run time.
        single: All numbers are floats, for a microcontroller without a double-precision unit.
        estimation: Noise models and life times of the estimation (``ibvs_estimate`` and ``ibvs_command``); None writes
            the controller alone.

    Raises:
        ConfigError: When the configuration has something that the library has not.
    """
    _check(config, single)
    if single:
        solver = dataclasses.replace(
            config.solver,
            tolerance=max(config.solver.tolerance, SINGLE_TOLERANCE),
            max_iterations=min(config.solver.max_iterations, SINGLE_ITERATIONS),
            relative_tolerance=max(config.solver.relative_tolerance, SINGLE_RELATIVE_TOLERANCE),
        )
        config = dataclasses.replace(config, solver=solver)
    folder.mkdir(parents=True, exist_ok=True)
    problem = qp_problem(config)
    tick = TickCode(problem, () if estimation is None else FROM_LAW)
    tick.write(folder, single)
    write_layout(folder, problem, tick, single)
    write_tables(folder, problem, tick, single)
    write_program(folder, problem, config.solver, single)
    shutil.copytree(SHELL, folder, dirs_exist_ok=True)
    if estimation is not None:
        write_estimation(folder, config, estimation, tick, single)


def _check(config: ControllerConfig, single: bool) -> None:
    if not config.thrust_rows:
        raise ConfigError("thrust_rows: the C library keeps the thrust limits in the program, so it must be true")
    if config.solver.name != "osqp":
        raise ConfigError(f"solver.name = {config.solver.name!r} is refused: the C library has osqp only")
    count = config.vehicle.geometry.count
    if single and count > WRENCH:
        raise ConfigError(
            f"vehicle.geometry: {count} rotors in single precision are refused: rounding moves thrusts that share a "
            f"wrench by more than 0.2 N a tick; export it in double precision, or a vehicle of {WRENCH} rotors"
        )
