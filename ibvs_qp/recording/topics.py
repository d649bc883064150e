"""Messages of a tick, made in the thread of the log."""

from __future__ import annotations

from typing import Any

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log

from ibvs_qp.command import Command
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.wall_lines import WallAxes
from ibvs_qp.frames import down_in_body, rotate
from ibvs_qp.measurement import Measurement, RgbdFrame, SensorFrame
from ibvs_qp.recording import poses, shapes
from ibvs_qp.recording.camera import CameraTopics
from ibvs_qp.recording.messages import encode
from ibvs_qp.recording.ticks import ControllerInput, ControlTick
from ibvs_qp.recording.writer import Sink
from ibvs_qp.vision.perception_result import PerceptionResult

INPUT_TOPIC, CONTROL_TOPIC, SENSORS_TOPIC = "/controller/input", "/control", "/sensors"
#: Least time between poses, and between shapes that do not change [ns].
POSE_NS, SHAPE_NS = 40_000_000, 1_000_000_000


class TickTopics:
    """Writes what a recorder hands over.

    Args:
        vehicle: The vehicle, for its picture.
    """

    def __init__(self, vehicle: VehicleParams) -> None:
        self._vehicle, self._camera = vehicle, CameraTopics()
        self._pose_ns, self._shape_ns = -POSE_NS, -SHAPE_NS
        self._said: tuple[Any, ...] = ()

    def write_tick(
        self,
        sink: Sink,
        numbers: tuple[int, int, int, float],
        state: tuple[ContactState, Any, Any],
        call: str,
        given: tuple[Any, Any, Any, Any],
        own: Command,
        command: Command,
        phase: str = "",
        seen: tuple[ContactState, float, float] | None = None,
    ) -> None:
        """Write input, command and poses of a tick.

        Args:
            sink: The file.
            numbers: Number of the tick, duration of the step [ns], dropped entries, push reference [N].
            state: Contact of the controller, lower and upper thrust limits [N].
            call: `STEP` or `SUPERVISOR`.
            given: Measurement, reference, contact and fixed thrusts of the controller.
            own: Command of the law, or of what replaced it.
            command: Command of the step.
            phase: Phase of a pilot's strategy.
            seen: Contact of a pilot, and its odometer right and down [m].
        """
        tick, step_ns, dropped, push_reference = numbers
        measurement, reference, contact, fixed = given
        exact = ControllerInput(
            tick=tick, call=call, measurement=measurement, reference=reference, contact=contact, fixed_thrusts=fixed
        )
        sink.write(INPUT_TOPIC, encode(exact), own.stamp_ns or None)
        found, low, high = state
        if seen is not None:
            found = seen[0]
        row = ControlTick(
            tick=tick,
            stamp_ns=own.stamp_ns,
            phase=phase,
            safety=command.safety,
            safety_reasons=command.safety_reasons,
            rejected=command.rejected,
            push_n=found.push,
            push_reference_n=push_reference,
            distance_m=found.distance,
            thrust_low_n=low,
            thrust_high_n=high,
            step_us=step_ns * 1e-3,
            dropped=dropped,
            command=own,
        )
        sink.write(CONTROL_TOPIC, encode(row))
        self._say(sink, phase, command)
        now = sink.stamp_ns
        if isinstance(measurement, Measurement) and found.known and abs(now - self._pose_ns) >= POSE_NS:
            self._pose_ns = now
            self._write_pose(sink, measurement, found, seen[1:] if seen else (0.0, 0.0), own)

    def write_input(self, sink: Sink, given: ControllerInput) -> None:
        """Write an input alone."""
        sink.write(INPUT_TOPIC, encode(given))

    def write_frame(self, sink: Sink, frame: SensorFrame) -> None:
        """Write the raw sensors of a pilot's tick."""
        sink.write(SENSORS_TOPIC, encode(frame, SensorFrame))

    def write_picture(self, sink: Sink, picture: RgbdFrame, perceived: PerceptionResult | None, stamp_ns: int) -> None:
        """Write a picture and what was seen in it."""
        self._camera(sink, picture, perceived, stamp_ns)

    def write_note(self, sink: Sink, name: str, text: str) -> None:
        """Write a line."""
        sink.note(Log.INFO, name, text)

    def _say(self, sink: Sink, phase: str, command: Command) -> None:
        """Write what changed in words: phase, state of the supervisor, refused inputs."""
        # The numbers after a colon may change from tick to tick.
        refused = tuple([reason.split(":")[0] for reason in command.rejected])
        now = phase, command.safety, refused
        if now == self._said:
            return
        before, self._said = self._said or ("", None, ()), now
        if phase != before[0]:
            sink.note(Log.INFO, "phase", phase)
        if command.safety != before[1] and before[1] is not None:
            reasons = "; ".join(command.safety_reasons)
            sink.note(Log.WARNING, "supervisor", f"{command.safety}: {reasons}".removesuffix(": "))
        for reason, name in zip(command.rejected, refused, strict=True):
            if name not in before[2]:
                sink.note(Log.WARNING, "rejected", reason)

    def _write_pose(
        self, sink: Sink, measurement: Measurement, contact: ContactState, odometer: Any, own: Command
    ) -> None:
        """Write the pose at the wall; along it by a pilot's odometer, otherwise it is not known and 0."""
        now, vehicle = sink.stamp_ns, self._vehicle
        axes = WallAxes.of(contact.normal, down_in_body(measurement.attitude.tolist()))
        rotation = poses.wall_from_body(axes.right, axes.down, axes.normal)
        right, down = odometer
        tip = rotate(rotation, vehicle.tip_position_m)
        position = (-contact.distance - tip[0], -right - tip[1], -down - tip[2])
        turn = poses.quaternion(rotation)
        frames = FrameTransforms()
        poses.transform(frames, poses.WALL, poses.VEHICLE, position, turn, now)
        if abs(now - self._shape_ns) >= SHAPE_NS:
            self._shape_ns = now
            poses.mounts(frames, vehicle, now)
            sink.write("/vehicle/shape", shapes.vehicle_scene(vehicle, poses.VEHICLE, now))
            sink.write("/vehicle/points", shapes.vehicle_points(vehicle, now))
            sink.write("/wall/shape", shapes.estimated_wall(now))
            sink.write("/wall/points", shapes.wall_points(now))
        sink.write("/tf", frames)
        sink.write("/vehicle/pose", poses.pose_in_frame(poses.WALL, position, turn, now))
        sink.write("/vehicle/forces", shapes.force_arrows(vehicle, own.thrusts, contact.push, contact.normal, now))
