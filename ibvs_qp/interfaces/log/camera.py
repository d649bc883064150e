"""Pictures of the log: colour as JPEG, depth, calibration, and detections as annotations."""

from __future__ import annotations

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from ibvs_qp.interfaces.log.scene import CAMERA, DEPTH_CAMERA, Message, rgba
from ibvs_qp.interfaces.log.writer import LogWriter, timestamp
from ibvs_qp.interfaces.overlay import draw_overlay
from ibvs_qp.measurement import RgbdFrame
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
