"""Topics of a tick: its exact inputs for replay, a row for plots, changes as text, and the pose at the wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log

from ibvs_qp.command import Command, SafetyState
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.wall_lines import WallAxes
from ibvs_qp.frames import down_in_body, rotate
from ibvs_qp.interfaces.log import scene
from ibvs_qp.interfaces.log.messages import encode
from ibvs_qp.interfaces.log.writer import LogWriter
from ibvs_qp.measurement import Measurement, Reference

INPUT_TOPIC, CONTROL_TOPIC, SENSORS_TOPIC = "/controller/input", "/control", "/sensors"
#: Least time between poses, and between shapes that do not change [ns].
POSE_NS, SHAPE_NS = 40_000_000, 1_000_000_000
#: Kinds of a `ControllerInput`: a step of the controller, thrusts of the supervisor in its place, and a reset.
STEP, SUPERVISOR, RESET = "step", "supervisor", "reset"


@dataclass(kw_only=True)
class ControllerInput:
    """Exact inputs of the controller at one tick, for replay.

    Attributes:
        tick: Number, from 0; a gap means lost ticks.
        call: ``step``, ``supervisor`` or ``reset``.
        measurement: As given to the controller.
        reference: As given to the controller.
        contact: As a pilot estimates it; None where the controller estimates it.
        fixed_thrusts: Of the supervisor [N], (n,), before box and rate limit.
    """

    tick: int
    call: str
    measurement: Measurement | None = None
    reference: Reference | None = None
    contact: ContactState | None = None
    fixed_thrusts: np.ndarray | None = None


@dataclass(kw_only=True)
class ControlTick:
    """One tick, for plots.

    Attributes:
        tick: Number of the tick, as in its `ControllerInput`.
        stamp_ns: Time of the tick.
        phase: Of a pilot's strategy; empty without a pilot.
        safety: State of the supervisor; nominal without one.
        safety_reasons: Why it is in that state.
        rejected: Inputs refused by pilot and controller.
        push_n: Filtered push [N].
        push_reference_n: Push reference within reach [N].
        distance_m: Tip to wall [m].
        thrust_low_n: Lower thrust limits in force [N], (n,).
        thrust_high_n: Upper thrust limits in force [N], (n,).
        step_us: Duration of the step [us].
        dropped: Entries dropped so far, because the writer was late.
        command: Of the law, or of the supervisor in its place.
    """

    tick: int
    stamp_ns: int
    phase: str
    safety: SafetyState
    safety_reasons: tuple[str, ...]
    rejected: tuple[str, ...]
    push_n: float
    push_reference_n: float
    distance_m: float
    thrust_low_n: np.ndarray
    thrust_high_n: np.ndarray
    step_us: float
    dropped: int
    command: Command


def write_message(log: LogWriter, topic: str, value: Any, kind: type | None = None) -> None:
    """Write a dataclass as a message of its kind, by default its own."""
    log.write(topic, encode(value, kind))


class TickTopics:
    """Writes the ticks of one flight, in the thread of the log."""

    def __init__(self, vehicle: VehicleParams) -> None:
        self._vehicle, self._pose_ns, self._shape_ns = vehicle, -POSE_NS, -SHAPE_NS
        self._words: tuple[Any, ...] = ("", None, ())

    def __call__(
        self,
        log: LogWriter,
        given: ControllerInput,
        row: ControlTick,
        contact: ContactState,
        odometer: Sequence[float] = (0.0, 0.0),
    ) -> None:
        """Write a tick.

        Args:
            log: The log.
            given: Inputs of the controller.
            row: The tick.
            contact: Wall and contact, of a pilot or of the controller.
            odometer: Way of a pilot right and down [m]; without one it is not known and 0.
        """
        log.write(INPUT_TOPIC, encode(given), row.stamp_ns or None)
        log.write(CONTROL_TOPIC, encode(row))
        self._note_changes(log, row)
        measurement, now = given.measurement, log.stamp_ns
        if isinstance(measurement, Measurement) and contact.known and abs(now - self._pose_ns) >= POSE_NS:
            self._pose_ns = now
            if np.isfinite(measurement.attitude).all():
                self._write_pose(log, measurement, contact, odometer, row.command.thrusts)

    def _note_changes(self, log: LogWriter, row: ControlTick) -> None:
        """Write changes of phase, supervisor and refused inputs in words."""
        # The numbers after a colon may change from tick to tick.
        refused = tuple([reason.split(":")[0] for reason in row.rejected])
        (phase, safety, known), self._words = self._words, (row.phase, row.safety, refused)
        if row.phase != phase:
            log.note(Log.INFO, "phase", row.phase)
        if safety not in (None, row.safety):
            log.note(Log.WARNING, "supervisor", f"{row.safety}: {'; '.join(row.safety_reasons)}".removesuffix(": "))
        for reason, name in zip(row.rejected, refused, strict=True):
            if name not in known:
                log.note(Log.WARNING, "rejected", reason)

    def _write_pose(
        self,
        log: LogWriter,
        measurement: Measurement,
        contact: ContactState,
        odometer: Sequence[float],
        thrusts: np.ndarray,
    ) -> None:
        now, vehicle = log.stamp_ns, self._vehicle
        axes = WallAxes.of(contact.normal, down_in_body(measurement.attitude.tolist()))
        rotation = scene.wall_from_body(axes)
        (right, down), tip = odometer, rotate(rotation, vehicle.tip_position_m)
        position = (-contact.distance - tip[0], -right - tip[1], -down - tip[2])
        turn = scene.quaternion(rotation)
        frames = [scene.transform(scene.WALL, scene.VEHICLE, position, turn, now)]
        if abs(now - self._shape_ns) >= SHAPE_NS:
            self._shape_ns = now
            frames += scene.mounts(vehicle, now)
            log.write("/vehicle/shape", scene.vehicle_scene(vehicle, scene.VEHICLE, now))
            log.write("/vehicle/points", scene.vehicle_points(vehicle, now))
            log.write("/wall/shape", scene.estimated_wall(now))
            log.write("/wall/points", scene.wall_points(now))
        log.write("/tf", FrameTransforms(transforms=frames))
        log.write("/vehicle/pose", scene.pose_in_frame(scene.WALL, position, turn, now))
        log.write("/vehicle/forces", scene.force_arrows(vehicle, thrusts, contact.push, contact.normal, now))
