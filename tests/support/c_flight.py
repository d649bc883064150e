"""A flight in the C library with estimation, from Python; and the same flight of the pilot, tick by tick."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from c_binding import Structures, structure
from recorded_inputs import recording

from ibvs_qp.command import Command
from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.estimation.wall_motion import SLOTS
from ibvs_qp.interfaces.c_library.recorded import FlightTick, other_solution
from ibvs_qp.measurement import VERTICAL, FeatureFrame, Measurement, Reference, SensorFrame
from ibvs_qp.pilot import Pilot
from tests.replay.cases import CASES

KINDS = {"": 0, "board": 1, "paint": 2}
#: Numbers of a tracked line that both have by the same name.
LINE_NUMBERS = (
    "offset",
    "deviation",
    "residual",
    "angle",
    "weight",
    "seen_angle",
    "middle",
    "length",
    "surface_side",
)


class Estimated(NamedTuple):
    """Estimates of one tick."""

    wall_known: bool
    in_contact: bool
    stiffness_known: bool
    tared: bool
    velocity_known: bool
    numbers: dict[str, np.ndarray]
    lines: dict[int, dict[str, float]]  # by track


class PilotTick(NamedTuple):
    """Inputs and results of one tick of the pilot."""

    tick: FlightTick
    followed: tuple[int, ...]  # tracks of the lines of the measurement
    estimated: Estimated
    command: Command


@functools.cache
def recorded_flight(case: str) -> list[PilotTick]:
    """A recorded flight through a new pilot."""
    return flown(CASES[case].pilot(), recording(case).frames)


def flown(pilot: Pilot, frames: Sequence[SensorFrame], derated: int = -1, most_n: float = 0.0) -> list[PilotTick]:
    """Frames through a pilot; from a tick on, every rotor gives so much at most [N]."""
    ticks, rotors = [], pilot.config.controller.vehicle.geometry.count
    for place, frame in enumerate(frames):
        if place == derated:
            pilot.thrust_limits = np.zeros(rotors), np.full(rotors, most_n)
        asked = pilot.setpoints.push_reference
        command = pilot.step(frame)
        assert pilot.measurement is not None
        followed = tuple(line.track_id for line in pilot.measurement.lines)
        other = other_solution(pilot.controller, command)
        tick = FlightTick(frame, pilot.measurement, pilot.reference, command.thrusts, other)
        ticks.append(PilotTick(tick, followed, estimated(pilot, asked), command))
    return ticks


def estimated(pilot: Pilot, push_reference: float) -> Estimated:
    """Estimates of the last tick; ``push_reference`` is that before it [N]."""
    contact, motion, estimator = pilot.contact.state, pilot.motion, pilot.estimator
    numbers = {
        "normal": contact.normal,
        "distance": contact.distance if contact.known else 0.0,
        "distance_rate": contact.rate,
        "push": contact.push,
        "push_noise": contact.push_noise,
        "push_reference": push_reference,
        "time_in_contact": contact.time_since_touch,
        "stiffness": contact.stiffness,
        "velocity": motion.state[:2],
        "odometer": motion.state[4:6],
        "attitude": estimator.attitude,
        "angular_velocity": estimator.rate,
        "wrench": estimator.wrench,
    }
    return Estimated(
        contact.known,
        contact.in_contact,
        contact.stiffness_known,
        estimator.tared,
        motion.velocity_age_s < pilot.config.estimation.velocity_life_s,
        {name: np.array(value, float) for name, value in numbers.items()},
        {track: _numbers_of(line, line.frames) for track, line in motion.lines.items()},
    )


def _numbers_of(line: TrackedLine | Any, pictures: int) -> dict[str, float]:
    return {name: float(getattr(line, name)) for name in LINE_NUMBERS} | {"pictures": float(pictures)}


class CFlight:
    """One instance of a built library with estimation.

    Attributes:
        estimates, command: Results of the last tick, as structures.

    Args:
        library: ``libibvs_qp.so``.
        config: The configuration it was written for.
        rows: Rows of the program, of its limits.
        single: Whether its numbers are floats.
    """

    def __init__(self, library: Path, config: ControllerConfig, rows: int, single: bool = False) -> None:
        self._library = ctypes.CDLL(str(library))
        self._types = types = Structures(config, rows, single)
        real, flag, stamp, whole = types.real, ctypes.c_bool, ctypes.c_int64, ctypes.c_int32
        rotors, lines = config.vehicle.geometry.count, len(types.measurement().lines)
        self._frame = structure(
            "ibvs_frame",
            stamp_ns=stamp,
            attitude=real * 4,
            angular_velocity=real * 3,
            specific_force=real * 3,
            wrench=real * 6,
            wrench_stamp_ns=stamp,
            has_thrust_min=flag,
            has_thrust_max=flag,
            thrust_min=real * rotors,
            thrust_max=real * rotors,
        )
        numbers = {name: real for name in ("rho", "theta", "variance", "weight")}
        seen = {"has_segment": flag, "segment": real * 4, "covariance": real, "theta_variance": real}
        line = {"track_id": stamp, "role": whole, "kind": whole, "surface_side": whole}
        self._features = structure(
            "ibvs_features",
            stamp_ns=stamp,
            has_plane=flag,
            plane=real * 4,
            curvature=real * 3,
            has_velocity=flag,
            velocity=real * 3,
            velocity_covariance=real * 9,
            velocity_stamp_ns=stamp,
            line_count=whole,
            lines=structure("ibvs_line_feature", **line, **numbers, **seen) * lines,
        )
        tracked = dict.fromkeys(("offset", "deviation", "residual", "angle", "angle_variance", "weight"), real)
        tracked |= dict.fromkeys(("fresh_weight", "seen_angle", "middle", "length"), real)
        stamps = {"slot": whole, "pictures": whole, "seen_ns": stamp, "fresh_ns": stamp}
        flags = ("valid", "wall_known", "in_contact", "stiffness_known", "tared", "velocity_known")
        scalars = ("distance", "distance_rate", "push", "push_noise", "push_reference", "time_in_contact", "stiffness")
        self.estimates = structure(
            "ibvs_estimates",
            stamp_ns=stamp,
            rejected=whole,
            **dict.fromkeys(flags, flag),
            normal=real * 3,
            **dict.fromkeys(scalars, real),
            velocity=real * 2,
            odometer=real * 2,
            attitude=real * 4,
            angular_velocity=real * 3,
            wrench=real * 6,
            line_count=whole,
            lines=structure("ibvs_tracked_line", **line, **stamps, **tracked) * SLOTS,
        )()
        self.command = types.command()
        self._memory = ctypes.create_string_buffer(self._library.ibvs_flight_size() + 16)
        self._instance = ctypes.c_void_p(-(-ctypes.addressof(self._memory) // 16) * 16)
        self._library.ibvs_flight_init(self._instance)

    def reset(self) -> None:
        """As after construction."""
        self._library.ibvs_flight_reset(self._instance)

    def estimate(self, frame: SensorFrame, measurement: Measurement | None = None) -> Any:
        """Estimates of one tick; with the thrust limits of a measurement."""
        own, features = self._frame(), frame.features
        for name in ("thrust_min", "thrust_max"):
            if measurement is not None and (limits := getattr(measurement, name)) is not None:
                setattr(own, f"has_{name}", True)
                getattr(own, name)[:] = limits.tolist()
        for name in ("attitude", "angular_velocity", "specific_force", "wrench"):
            getattr(own, name)[:] = getattr(frame, name).tolist()
        own.stamp_ns, own.wrench_stamp_ns = frame.stamp_ns, frame.wrench_stamp_ns
        given = None if features is None else ctypes.byref(self._packed(features))
        self._library.ibvs_estimate(self._instance, ctypes.byref(own), given, ctypes.byref(self.estimates))
        return self.estimates

    def act(self, reference: Reference, followed: Sequence[int]) -> Any:
        """Command of the tick."""
        targets, tracks = self._types.packed_reference(reference), (ctypes.c_int64 * len(followed))(*followed)
        given = ctypes.byref(targets), tracks, len(followed), ctypes.byref(self.command)
        self._library.ibvs_command(self._instance, *given)
        return self.command

    def target(self, line: Any, offset: float) -> Any:
        """Reference of a line of the estimates at an offset from the tip [m]."""
        function = self._library.ibvs_line_target
        function.restype, function.argtypes = (
            self._types.line_reference,
            (ctypes.c_void_p, ctypes.c_void_p, self._types.real),
        )
        return function(ctypes.byref(self.estimates), ctypes.byref(line), offset)

    def _packed(self, features: FeatureFrame) -> Any:
        own = self._features(stamp_ns=features.stamp_ns, velocity_stamp_ns=features.velocity_stamp_ns)
        for name in ("plane", "curvature", "velocity", "velocity_covariance"):
            value = getattr(features, name)
            if value is not None:
                getattr(own, name)[:] = np.ravel(value).tolist()
        own.has_plane, own.has_velocity = features.plane is not None, features.velocity is not None
        own.line_count = len(features.lines)
        for place, line in zip(own.lines, features.lines, strict=False):
            for name in ("track_id", "surface_side", "rho", "theta", "weight"):
                setattr(place, name, getattr(line, name))
            place.role, place.kind, place.variance = int(line.role == VERTICAL), KINDS[line.kind], line.covariance[0, 0]
            place.covariance, place.theta_variance = line.covariance[0, 1], line.covariance[1, 1]
            place.has_segment = line.segment is not None
            if line.segment is not None:
                place.segment[:] = line.segment.ravel().tolist()
        return own

    def estimated(self) -> Estimated:
        """Estimates of the last tick."""
        own = self.estimates
        names = (
            "normal",
            "distance",
            "distance_rate",
            "push",
            "push_noise",
            "push_reference",
            "time_in_contact",
            "stiffness",
            "velocity",
        )
        numbers = {
            name: np.array(getattr(own, name))
            for name in (*names, "odometer", "attitude", "angular_velocity", "wrench")
        }
        if not own.wall_known:
            numbers["distance"] = np.zeros(())
        flags = own.wall_known, own.in_contact, own.stiffness_known, own.tared, own.velocity_known
        lines = {line.track_id: _numbers_of(line, line.pictures) for line in own.lines[: own.line_count]}
        return Estimated(*flags, numbers, lines)
