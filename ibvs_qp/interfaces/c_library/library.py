"""The C library of a configuration: generated tick, estimators and OSQP, and the shell that is the same for all."""

from __future__ import annotations

import dataclasses
import math
import shutil
from pathlib import Path

import casadi as ca
import numpy as np

from ibvs_qp.config import LONGEST_TICK, ControllerConfig, EstimationConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import HybridController, qp_problem
from ibvs_qp.estimation.estimator import ATTITUDE, INERTIAL, LEAST_RATIO, RATE, prediction_signals
from ibvs_qp.estimation.inputs import CONTACT
from ibvs_qp.estimation.tick_history import AHEAD, BEFORE, FIRST_INTERVAL, HISTORY_S, LONGEST_INTERVAL
from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.estimation.wall_motion import (
    BIAS,
    GAP_NS,
    GAP_VELOCITY_STD,
    KNOWN_STD,
    LEAST_VARIANCE,
    LINES,
    ODOMETER,
    SLOTS,
    STATES,
    VELOCITY,
    VELOCITY_STD,
    Correction,
    correction_signals,
)
from ibvs_qp.frames import GRAVITY, rotation_from_vector, to_camera
from ibvs_qp.interfaces.c_library.tables import enumeration, field_rows, write_layout, write_tables
from ibvs_qp.interfaces.c_library.tick_code import TickCode, write_function
from ibvs_qp.measurement import FeatureFrame, Measurement, channels
from ibvs_qp.model.tick import ESTIMATED
from ibvs_qp.pilot.estimation import ASSUMED_DISTANCE
from ibvs_qp.qp.program_code import real, table, write_program
from ibvs_qp.symbolic.function import step_function
from ibvs_qp.symbolic.signals import Signals, places
from ibvs_qp.validation.fields import SENSOR_FRAME, FieldTable

#: The shell: code that is independent of the configuration.
ESTIMATION_SHELL = Path(__file__).parent / "c_estimation"
#: Outputs of the law for the next tick: of the prediction, and of the strategy.
FROM_LAW = ("motors_force", "push_reference")
#: Largest difference of the two halves of a covariance, relative: rounding.
ASYMMETRY = 1e-5


def write_estimation(
    folder: Path, config: ControllerConfig, estimation: EstimationConfig, tick: TickCode, single: bool
) -> None:
    """Write the estimation of a library: generated functions, layout, tables and shell.

    Args:
        folder: Folder of the library.
        config: Configuration of the controller.
        estimation: Noise models and life times; compiled in.
        tick: The law's function, with the outputs `FROM_LAW`.
        single: All numbers are floats.
    """
    vehicle = config.vehicle
    from_camera = np.subtract(vehicle.tip_position_m, vehicle.camera_position_m)
    predict, correct = prediction_signals(config, estimation), correction_signals(from_camera.tolist(), estimation)
    functions = {"predict": step_function(predict), "correct": step_function(correct)}
    write_function(folder, "ibvs_predict", functions["predict"], "Sensors to attitude, contact and motion", single)
    write_function(folder, "ibvs_correct", functions["correct"], "One measurement of a picture to a change", single)
    given = _given_places(predict, tick)
    frame = FieldTable(*[row for row in SENSOR_FRAME.rows if row.name in (*INERTIAL, "wrench")])
    right, below, ahead = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m)).tolist()
    sizes = {
        "TRACKS": SLOTS,
        "MOTION_STATES": STATES,
        "HISTORY": max(2, round(HISTORY_S / config.tick_s)),
        "STATE_ATTITUDE": ATTITUDE.start,
        "STATE_RATE": RATE.start,
        "FRAME_FIELDS": len(frame.rows),
        "GIVEN_ENTRIES": len(given),
        "MOST_STATES": max(function.numel_in(1) for function in functions.values()),
    }
    for name, function in functions.items():
        sizes[f"{name.upper()}_INPUTS"], sizes[f"{name.upper()}_STATES"] = function.numel_in(0), function.numel_in(1)
        sizes[f"{name.upper()}ED"] = function.numel_out(2)
    tick_ns = max(1, round(config.tick_s * 1e9))
    times = {"GAP_NS": GAP_NS, "AHEAD_NS": math.floor(AHEAD * tick_ns), "BEFORE_NS": math.floor(BEFORE * tick_ns)}
    constants = {
        "LONGEST_TICK": LONGEST_TICK,
        "FIRST_INTERVAL": FIRST_INTERVAL,
        "LONGEST_INTERVAL": LONGEST_INTERVAL,
        "VELOCITY_LIFE_S": estimation.velocity_life_s,
        "FADE_START_S": estimation.fade_start_s,
        "FADE_END_S": estimation.fade_end_s,
        "FRAMES_TO_TRUST": estimation.frames_to_trust,
        "REFUSAL_S": estimation.refusal_s,
        "VELOCITY_STD": VELOCITY_STD,
        "GAP_VELOCITY_STD": GAP_VELOCITY_STD,
        "KNOWN_STD": KNOWN_STD,
        "LEAST_VARIANCE": LEAST_VARIANCE,
        "FIRST_ANGLE_VARIANCE": TrackedLine.__dataclass_fields__["theta_variance"].default,
        "LEAST_RATIO": LEAST_RATIO,
        "ASSUMED_DISTANCE": ASSUMED_DISTANCE,
        "VELOCITY_BOUND": channels(FeatureFrame)["velocity"].high,
        "CURVATURE_BOUND": channels(FeatureFrame)["curvature"].high,
        "ASYMMETRY": ASYMMETRY,
        "TIP_RIGHT": right,
        "TIP_BELOW": below,
        "TIP_AHEAD": ahead,
        "QUARTER_TURN": 0.5 * math.pi,
    }
    results = {name: slice(place, place) for place, name in enumerate(Correction._fields)}
    motion = {"velocity": VELOCITY, "bias": BIAS, "odometer": ODOMETER, "lines": slice(LINES, STATES)}
    lines = [
        "/* Sizes, places and constants of the estimation; generated. */",
        "#ifndef IBVS_ESTIMATION_LAYOUT_H",
        "#define IBVS_ESTIMATION_LAYOUT_H",
        "",
        '#include "ibvs_layout.h"',
        "",
        *(f"#define IBVS_{name} {value}" for name, value in sizes.items()),
        *(f"#define IBVS_{name} INT64_C({value})" for name, value in times.items()),
        *(f"#define IBVS_{name} {real(value, single)}" for name, value in constants.items()),
        "",
        "/* Places in the motion, and of inputs and results. */",
        *enumeration("MOTION", motion),
        *enumeration("PREDICT", places(predict.inputs)),
        *enumeration("PREDICTED", places(predict.outputs)),
        *enumeration("CORRECT", places(correct.inputs)),
        *enumeration("CORRECTED", results | places(correct.outputs)),
        "#endif",
        "",
    ]
    (folder / "ibvs_estimation_layout.h").write_text("\n".join(lines))
    turn = np.radians(vehicle.force_torque_turn_deg)
    arrays = {
        "predict_start": np.concatenate([predict.starts[name] for name in predict.states]),
        "correct_start": np.concatenate([correct.starts[name] for name in correct.states]),
        "force_axes": rotation_from_vector(turn),
        "tip_from_camera": from_camera,
    }
    code = [
        "/* Bounds of the frame, start values and vehicle; generated. */",
        '#include "ibvs_estimation_internal.h"',
        "",
        *field_rows("frame", frame, single),
        *(table("ibvs_real", f"ibvs_{name}", values, single) for name, values in arrays.items()),
        table("uint16_t", "ibvs_given_places", given, single),
        "",
    ]
    (folder / "ibvs_estimation_tables.c").write_text("\n".join(code))
    shutil.copytree(ESTIMATION_SHELL, folder, dirs_exist_ok=True)


def _given_places(predict: Signals, tick: TickCode) -> np.ndarray:
    """Places of the estimated contact, (n, 2): in the inputs of the tick, and in the results of the prediction."""
    inputs, results = places(tick.signals.inputs), places(predict.outputs)
    names = {name: ESTIMATED.get(name, name) for name in ("normal", "contact_weight", *CONTACT)}
    pairs = [
        (inputs[f"given.{name}"].start + entry, results[estimated].start + entry)
        for name, estimated in names.items()
        for entry in range(ca.SX(predict.outputs[estimated]).numel())
    ]
    return np.array(pairs)


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
