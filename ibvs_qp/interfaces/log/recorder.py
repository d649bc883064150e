"""Recorder: its `step` in place of a controller's records the flight in a file that viewers open and that replays."""

from __future__ import annotations

import re
import time
import typing
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from ibvs_qp.checked_law import CheckedLaw
from ibvs_qp.command import Command
from ibvs_qp.interfaces.log import topics
from ibvs_qp.interfaces.log.header import header
from ibvs_qp.interfaces.log.scene import CAMERA, DEPTH_CAMERA, Message, rgba
from ibvs_qp.interfaces.log.writer import PICTURE_ROOM, Log, LogWriter, timestamp
from ibvs_qp.interfaces.overlay import draw_overlay
from ibvs_qp.measurement import FeatureFrame, LineFeature, Measurement, Reference, RgbdFrame, SensorFrame
from ibvs_qp.pilot import LawCall, Pilot
from ibvs_qp.supervision.assured import Assured
from ibvs_qp.vision.perception import PerceptionResult
from ibvs_qp.vision.picture.picture import denormalise

#: Quality of the JPEGs [-]: no difference is visible, at 60 kB a picture of 640x480.
JPEG_QUALITY = 85
#: Least time between depth pictures, and between pictures with drawn detections [ns].
SELDOM_NS = 200_000_000
#: Every so many rows and columns of the depth are written, because its noise cannot be compressed.
DEPTH_STEP = 2
#: Depths in the log are whole millimetres in 16 bits [1/m]; 0 is invalid.
PER_METRE, DEEPEST = 1000.0, 65_535
#: Colours of tracks by kind (r, g, b, a), of lost or tentative ones, of the distance, and of the ground under labels.
_KINDS = {"board": (1.0, 0.63, 0.0, 1.0), "paint": (1.0, 0.0, 0.78, 1.0)}
_FAINT, _WHITE, _GROUND = (0.6, 0.6, 0.6, 1.0), (1.0, 1.0, 1.0, 1.0), (0.08, 0.08, 0.08, 1.0)
_WIDTH_PX, _FONT_PX = 2.0, 12.0


class CameraTopics:
    """Writes the pictures of one flight."""

    def __init__(self) -> None:
        self._seldom_ns = -SELDOM_NS

    def __call__(self, log: LogWriter, picture: RgbdFrame, perceived: PerceptionResult | None, stamp_ns: int) -> None:
        """Write one picture.

        Args:
            log: The log.
            picture: The rectified picture.
            perceived: Result of perception, or None.
            stamp_ns: Time of the tick; the messages carry the time of capture.
        """
        captured = picture.stamp_ns
        log.write("/camera/image", _jpeg(picture.rgb, captured), stamp_ns)
        log.write("/camera/calibration", _calibration(picture, CAMERA, 1))
        if perceived is not None:
            log.write("/camera/detections", detections(perceived, captured))
        if abs(captured - self._seldom_ns) < SELDOM_NS:
            return
        self._seldom_ns = captured
        log.write("/camera/depth", _depth(picture))
        log.write("/camera/depth_calibration", _calibration(picture, DEPTH_CAMERA, DEPTH_STEP))
        if perceived is not None:  # without tints: their arithmetic would hold up the control loop
            log.write("/camera/overlay", _jpeg(draw_overlay(picture.rgb, perceived, tints=False), captured))


def _jpeg(rgb: np.ndarray, ns: int) -> CompressedImage:
    _, data = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
    return CompressedImage(timestamp=timestamp(ns), frame_id=CAMERA, format="jpeg", data=data.tobytes())


def _depth(picture: RgbdFrame) -> RawImage:
    sparse = picture.depth[::DEPTH_STEP, ::DEPTH_STEP]
    whole = np.nan_to_num(sparse * PER_METRE + 0.5, nan=0.0, posinf=0.0, neginf=0.0)
    whole[(whole < 0.0) | (whole > DEEPEST)] = 0.0
    height, width = sparse.shape
    sizes = {"width": width, "height": height, "step": 2 * width, "encoding": "16UC1"}
    stamp, data = timestamp(picture.stamp_ns), whole.astype("<u2").tobytes()
    return RawImage(timestamp=stamp, frame_id=DEPTH_CAMERA, data=data, **sizes)


def _calibration(picture: RgbdFrame, frame_id: str, step: int) -> CameraCalibration:
    height, width = (-(-size // step) for size in picture.depth.shape)
    fx, fy, cx, cy = (value / step for value in picture.intrinsics)
    matrix = np.array(((fx, 0.0, cx), (0.0, fy, cy), (0.0, 0.0, 1.0)))
    return CameraCalibration(
        timestamp=timestamp(picture.stamp_ns),
        frame_id=frame_id,
        width=width,
        height=height,
        K=matrix.ravel(),
        R=np.eye(3).ravel(),
        P=np.column_stack((matrix, np.zeros(3))).ravel(),
    )


def detections(perceived: PerceptionResult, ns: int) -> ImageAnnotations:
    """Tracked lines with identity, kind and weight; distance of the wall, or the reason of its absence."""
    stamp, lines, labels = timestamp(ns), [], []

    def label(text: str, x: float, y: float, color: tuple[float, ...]) -> Message:
        colors = {"text_color": rgba(color), "background_color": rgba(_GROUND)}
        return {"timestamp": stamp, "text": text, "font_size": _FONT_PX, "position": {"x": x, "y": y}, **colors}

    for track in perceived.tracks:
        if perceived.intrinsics is None:
            break
        color = _KINDS.get(track.kind, _FAINT) if track.confirmed and track.seen else _FAINT
        (x0, y0), (x1, y1) = denormalise(track.segment, perceived.intrinsics).tolist()
        ends = [{"x": x0, "y": y0}, {"x": x1, "y": y1}]
        line = {"type": PointsAnnotation.LINE_LIST, "points": ends, "outline_color": rgba(color)}
        lines.append(line | {"timestamp": stamp, "thickness": _WIDTH_PX})
        text = f"{track.track_id} {track.kind} {track.weight:.1f} {track.hint}".rstrip()
        labels.append(label(text, 0.5 * (x0 + x1), 0.5 * (y0 + y1), color))
    plane = perceived.plane
    text = f"{plane.distance_m:.3f} m" if plane is not None else perceived.refused or "no surface"
    labels.append(label(text, 6.0, 6.0 + _FONT_PX, _WHITE))
    return ImageAnnotations(points=lines, texts=labels)


_COPIED = (Command, FeatureFrame, LineFeature, Measurement, Reference, RgbdFrame, SensorFrame)
_MUTABLE = re.compile(r"ndarray|tuple\[float|LineFeature|FeatureFrame|RgbdFrame")
#: Fields of the types that `copied` copies which contain arrays or such types.
_ARRAYS = {
    kind: [name for name, hint in typing.get_type_hints(kind).items() if _MUTABLE.search(str(hint))] for kind in _COPIED
}


class Recorder:
    """Records every step of a pilot or controller in an MCAP file (docs/logs.md).

    ``recorder = Recorder("flight.mcap", pilot)``, then ``recorder.step(frame)`` where ``pilot.step(frame)`` was, and
    ``recorder.close()`` at the end; the end of the process closes it, too. Nothing is encoded or written in `step`.

    Attributes:
        writer: The queue and the thread that writes.

    Args:
        file: The file; it is replaced.
        flown: A `Pilot`, an `Assured` controller, a `HybridController` or a `PaperController`.
        pictures: Whether pictures are recorded.

    Raises:
        ConfigError: When the extra ``log`` is not installed.
        IbvsQpError: When the file cannot be written.
    """

    def __init__(self, file: str | Path, flown: Pilot | Assured | CheckedLaw, *, pictures: bool = True) -> None:
        self._flown, self._pilot = flown, flown if isinstance(flown, Pilot) else None
        law: Any = flown if isinstance(flown, CheckedLaw) else flown.controller
        self._setpoints, self._pictures, self._tick = law.setpoints, pictures, 0
        self._call: LawCall | None = None
        self._topics, self._camera = topics.TickTopics(law.config.vehicle), CameraTopics()
        self.writer = LogWriter(file, header(flown), lambda: {"ticks": str(self._tick)})
        if self._pilot is not None:
            self._pilot.observer = self._observe

    def __enter__(self) -> Recorder:
        """The recorder itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self.close()

    @property
    def dropped(self) -> int:
        """Entries that are missing because the writer was late."""
        return self.writer.dropped

    @property
    def problem(self) -> str:
        """Why nothing more is written, such as a full disk; empty while all is well."""
        return self.writer.problem

    def step(self, *inputs: Any, **named: Any) -> Command:
        """``flown.step(...)``, recorded; never raises.

        Args:
            inputs: Those of the step: a sensor frame, or measurement, reference and maybe contact.
            named: The same by name.

        Returns:
            The command.
        """
        self._call = None
        begin = time.perf_counter_ns()
        command = self._flown.step(*inputs, **named)
        step_us = (time.perf_counter_ns() - begin) * 1e-3
        try:
            names = ("measurement", "reference", "contact") if self._pilot is None else ("frame",)
            self._record(dict(zip(names, inputs, strict=False)) | named, command, step_us)
        except Exception:  # of inputs of any type: the flight goes on, and the gap in the ticks shows it
            self.writer.dropped += 1
        self._tick += 1
        return command

    def reset(self) -> None:
        """``flown.reset()``, recorded."""
        self._flown.reset()
        given = topics.ControllerInput(tick=self._tick, call=topics.RESET)
        self.writer.offer(topics.write_message, topics.INPUT_TOPIC, given)
        self._tick += 1

    def note(self, name: str, text: str) -> None:
        """Write a line to the log's topic of events."""
        self.writer.offer(LogWriter.note, Log.INFO, name, text)

    def close(self) -> None:
        """Write the rest and the index."""
        if self._pilot is not None:
            self._pilot.observer = None
        self.writer.close()

    def _observe(self, call: LawCall) -> None:
        self._call = call

    def _record(self, inputs: dict[str, Any], command: Command, step_us: float) -> None:
        pilot, setpoints, limits = self._pilot, self._setpoints, self._setpoints.step.inputs
        if pilot is None:
            inputs = {name: copied(each) for name, each in inputs.items()}
            call = LawCall(inputs["measurement"], inputs["reference"], inputs.get("contact"), None, command)
            phase, contact, odometer = "", setpoints.contact, (0.0, 0.0)
        else:
            assert self._call is not None  # every step of a pilot calls its law or replaces it
            call, phase, contact = self._call, pilot.painter.phase, pilot.contact.state
            odometer = pilot.motion.state[4:6]
        given = topics.ControllerInput(
            tick=self._tick,
            call=topics.STEP if call.fixed is None else topics.SUPERVISOR,
            measurement=call.measurement,
            reference=call.reference,
            contact=call.contact,
            fixed_thrusts=call.fixed,
        )
        row = topics.ControlTick(
            tick=self._tick,
            stamp_ns=call.command.stamp_ns,
            phase=phase,
            safety=command.safety,
            safety_reasons=command.safety_reasons,
            rejected=command.rejected,
            push_n=contact.push,
            push_reference_n=setpoints.push_reference,
            distance_m=contact.distance,
            thrust_low_n=limits["thrust_low"].copy(),
            thrust_high_n=limits["thrust_high"].copy(),
            step_us=step_us,
            dropped=self.writer.dropped,
            command=copied(call.command),
        )
        self.writer.offer(self._topics, given, row, contact, tuple(odometer))
        if pilot is None:
            return
        frame = inputs["frame"]
        self.writer.offer(topics.write_message, topics.SENSORS_TOPIC, copied(frame, image=None), SensorFrame)
        if frame.image is not None and self._pictures and pilot.picture is not None:
            seen = copied(pilot.picture), pilot.perception_result, command.stamp_ns
            self.writer.offer(self._camera, *seen, room=PICTURE_ROOM)


def copied(value: Any, **replaced: Any) -> Any:
    """An input with arrays of its own, because the caller may use them again; other values as they are."""
    kind = type(value)
    if kind in (tuple, list):
        return kind([copied(each) if type(each) in _ARRAYS else each for each in value])
    if kind not in _ARRAYS:
        return value
    fields = value.__dict__ | replaced
    for name in _ARRAYS[kind]:
        entry = fields[name]
        fields[name] = entry.copy() if type(entry) is np.ndarray else copied(entry)
    twin = object.__new__(kind)
    twin.__dict__.update(fields)
    return twin
