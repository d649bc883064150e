"""Pictures of the log: colour as JPEG, depth, calibration, and what perception saw as annotations."""

from __future__ import annotations

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.recording.writer import Sink
from ibvs_qp.vision.lines.line_state import TrackState
from ibvs_qp.vision.overlay import draw_overlay
from ibvs_qp.vision.perception_result import PerceptionResult
from ibvs_qp.vision.picture.picture import denormalise

#: Frames of the pictures: optical axis along z, x to the right, y down.
CAMERA, DEPTH_CAMERA = "camera", "depth_camera"
#: Quality of the JPEGs [-]: no difference is visible, at 60 kB a picture of 640x480.
JPEG_QUALITY = 85
#: Least time between depth pictures, and between pictures with drawn detections [ns].
SELDOM_NS = 200_000_000
#: Every so many rows and columns of the depth are written.
DEPTH_STEP = 2
#: Depths in the log are whole millimetres in 16 bits [1/m]; 0 is invalid.
PER_METRE, DEEPEST = 1000.0, 65_535
#: Colours of tracks by kind (r, g, b), of lost or tentative ones, and of the ground under labels.
_KINDS = {"board": (1.0, 0.63, 0.0), "paint": (1.0, 0.0, 0.78)}
_FAINT, _GROUND = (0.6, 0.6, 0.6), (0.08, 0.08, 0.08)
_WIDTH_PX, _FONT_PX = 2.0, 12.0


class CameraTopics:
    """Writes the pictures of one flight."""

    def __init__(self) -> None:
        self._seldom_ns = -SELDOM_NS

    def __call__(self, sink: Sink, picture: RgbdFrame, perceived: PerceptionResult | None, stamp_ns: int) -> None:
        """Write one picture.

        Args:
            sink: The file.
            picture: The rectified picture.
            perceived: What was seen in it, or None.
            stamp_ns: Time of the tick; the messages carry the time of capture.
        """
        captured = picture.stamp_ns
        sink.write("/camera/image", _jpeg(picture.rgb, captured), stamp_ns)
        sink.write("/camera/calibration", _calibration(picture, captured, CAMERA, 1))
        if perceived is not None:
            sink.write("/camera/detections", detections(perceived, captured))
        if abs(captured - self._seldom_ns) < SELDOM_NS:
            return
        self._seldom_ns = captured
        sink.write("/camera/depth", _depth(picture.depth, captured))
        sink.write("/camera/depth_calibration", _calibration(picture, captured, DEPTH_CAMERA, DEPTH_STEP))
        if perceived is not None:  # without tints: their arithmetic would hold up the control loop
            sink.write("/camera/overlay", _jpeg(draw_overlay(picture.rgb, perceived, tints=False), captured))


def _jpeg(rgb: np.ndarray, stamp_ns: int) -> CompressedImage:
    _, data = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
    message = CompressedImage(frame_id=CAMERA, format="jpeg", data=data.tobytes())
    message.timestamp.FromNanoseconds(stamp_ns)
    return message


def _depth(depth: np.ndarray, stamp_ns: int) -> RawImage:
    """Depth in millimetres; every other row and column, because the noise cannot be compressed."""
    sparse = depth[::DEPTH_STEP, ::DEPTH_STEP]
    whole = np.nan_to_num(sparse * PER_METRE + 0.5, nan=0.0, posinf=0.0, neginf=0.0)
    whole[(whole < 0.0) | (whole > DEEPEST)] = 0.0
    height, width = sparse.shape
    data = whole.astype("<u2").tobytes()
    message = RawImage(frame_id=DEPTH_CAMERA, width=width, height=height, encoding="16UC1", step=2 * width, data=data)
    message.timestamp.FromNanoseconds(stamp_ns)
    return message


def _calibration(picture: RgbdFrame, stamp_ns: int, frame_id: str, step: int) -> CameraCalibration:
    height, width = (-(-size // step) for size in picture.depth.shape)
    fx, fy, cx, cy = (value / step for value in picture.intrinsics)
    message = CameraCalibration(
        frame_id=frame_id,
        width=width,
        height=height,
        K=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        P=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )
    message.timestamp.FromNanoseconds(stamp_ns)
    return message


def detections(perceived: PerceptionResult, stamp_ns: int) -> ImageAnnotations:
    """Tracked lines with identity, kind and weight; distance of the wall, or why there is none."""
    message = ImageAnnotations()
    if perceived.intrinsics is not None:
        for track in perceived.tracks:
            _annotate(message, track, denormalise(track.segment, perceived.intrinsics).tolist(), stamp_ns)
    refused = perceived.refused or "no surface"
    text = f"{perceived.plane.distance_m:.3f} m" if perceived.plane is not None else refused
    _label(message, text, (6.0, 6.0 + _FONT_PX), (1.0, 1.0, 1.0), stamp_ns)
    return message


def _annotate(message: ImageAnnotations, track: TrackState, ends: list[list[float]], stamp_ns: int) -> None:
    color = _KINDS.get(track.kind, _FAINT) if track.confirmed and track.seen else _FAINT
    line = message.points.add(type=PointsAnnotation.LINE_LIST, thickness=_WIDTH_PX)
    line.timestamp.FromNanoseconds(stamp_ns)
    _paint(line.outline_color, color)
    for x, y in ends:
        line.points.add(x=x, y=y)
    (x0, y0), (x1, y1) = ends
    text = f"{track.track_id} {track.kind} {track.weight:.1f} {track.hint}".rstrip()
    _label(message, text, (0.5 * (x0 + x1), 0.5 * (y0 + y1)), color, stamp_ns)


def _label(
    message: ImageAnnotations, text: str, place: tuple[float, float], color: tuple[float, float, float], stamp_ns: int
) -> None:
    label = message.texts.add(text=text, font_size=_FONT_PX)
    label.position.x, label.position.y = place
    label.timestamp.FromNanoseconds(stamp_ns)
    _paint(label.text_color, color)
    _paint(label.background_color, _GROUND)


def _paint(target: object, color: tuple[float, float, float]) -> None:
    target.r, target.g, target.b = color  # type: ignore[attr-defined]
    target.a = 1.0  # type: ignore[attr-defined]
