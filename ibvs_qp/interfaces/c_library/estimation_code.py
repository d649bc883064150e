"""Estimation of the C library: prediction and correction by CasADi, their sizes, places, constants and tables."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import casadi as ca
import numpy as np

from ibvs_qp.config import LONGEST_TICK, ControllerConfig, EstimationConfig
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
from ibvs_qp.frames import rotation_from_vector, to_camera
from ibvs_qp.interfaces.c_library.tables import enumeration, field_rows
from ibvs_qp.interfaces.c_library.tick_code import TickCode, write_function
from ibvs_qp.measurement import FeatureFrame, channels
from ibvs_qp.model.tick import ESTIMATED
from ibvs_qp.pilot.estimation import ASSUMED_DISTANCE
from ibvs_qp.qp.program_code import real, table
from ibvs_qp.symbolic.function import step_function
from ibvs_qp.symbolic.signals import Signals, places
from ibvs_qp.validation.fields import SENSOR_FRAME, FieldTable

#: The shell: code that is independent of the configuration.
SHELL = Path(__file__).parent / "c_estimation"
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
    shutil.copytree(SHELL, folder, dirs_exist_ok=True)


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
