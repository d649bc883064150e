"""The C library of a configuration: generated tick, generated OSQP, and the shell that is the same for all."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

import numpy as np

from ibvs_qp.config import ControllerConfig, EstimationConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import HybridController, qp_problem
from ibvs_qp.frames import GRAVITY
from ibvs_qp.interfaces.c_library.estimation_code import FROM_LAW, write_estimation
from ibvs_qp.interfaces.c_library.tables import write_layout, write_tables
from ibvs_qp.interfaces.c_library.tick_code import TickCode
from ibvs_qp.measurement import Measurement
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
#: Largest condition of the Hessian's block of the thrusts in single precision [-]: half a unit in the last place, 6e-8,
#: times it moves a thrust of 10 N by the 0.03 N that the self-test tolerates.
SINGLE_CONDITION = 5e4
#: Free flight at rest, 0.8 m in front of a wall.
_AT_REST = Measurement(
    stamp_ns=4_000_000,
    attitude=np.array((1.0, 0.0, 0.0, 0.0)),
    angular_velocity=np.zeros(3),
    specific_force=np.array((0.0, 0.0, -GRAVITY)),
    contact_wrench=np.zeros(6),
    wrench_stamp_ns=4_000_000,
    plane=(0.0, 0.0, 1.25, -1.0),
    plane_stamp_ns=4_000_000,
)


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
    if not single:
        return
    count = config.vehicle.geometry.count
    if count > WRENCH:
        raise ConfigError(
            f"vehicle.geometry: {count} rotors in single precision are refused: rounding moves thrusts that share a "
            f"wrench by more than 0.2 N a tick; export it in double precision, or a vehicle of {WRENCH} rotors"
        )
    solver = dataclasses.replace(config.solver, backend="python")  # one program is not worth a compilation
    law = HybridController(dataclasses.replace(config, solver=solver))
    hessian = law.program(_AT_REST).P[:count, :count]
    if (condition := np.linalg.cond(hessian)) > SINGLE_CONDITION:
        raise ConfigError(
            f"vehicle: the condition {condition:.1e} of the program's Hessian is refused in single precision (at most "
            f"{SINGLE_CONDITION:.0e}): rounding would move thrusts by more than 0.03 N; export it in double precision"
        )
