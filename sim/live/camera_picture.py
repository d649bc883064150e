"""Findings of the camera, small enough for a frame: a compressed picture with its tracks, or the lines alone."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.interfaces.overlay import draw_overlay
from sim.live.rows import LiveLoop
from sim.sensors.cameras.protocol import camera_intrinsics

#: Height of the picture [px], and its quality as a JPEG [-].
PICTURE_PX, _QUALITY = 240, 80
#: Colours of lines: board, paint, others (r, g, b); brightness of the ground.
_LINES, _OTHER, _GROUND = {"board": (255, 160, 0), "paint": (255, 0, 200)}, (150, 150, 150), 40
#: Half length of a line without ends, normalised [-].
_FAR = 2.0

#: A JPEG, or the picture's width and the lines: kind and ends [px].
Packed = bytes | tuple[int, list[tuple[str, list[list[int]]]]]


def packed_picture(loop: LiveLoop) -> Packed:
    """The picture of a flight with the tracked lines; without pictures, the lines alone."""
    pilot, camera = loop.pilot, loop.world.scene.camera
    size = round(PICTURE_PX * camera.width / camera.height), PICTURE_PX
    if pilot.picture is not None and pilot.perception_result is not None:
        drawn = cv2.resize(draw_overlay(pilot.picture.rgb, pilot.perception_result, words=False), size)
        quality = [int(cv2.IMWRITE_JPEG_QUALITY), _QUALITY]
        return cv2.imencode(".jpg", cv2.cvtColor(drawn, cv2.COLOR_RGB2BGR), quality)[1].tobytes()
    focal = camera_intrinsics(camera)[0] * PICTURE_PX / camera.height
    found = []
    for line in loop.features.lines if loop.features is not None else ():
        normal = np.array([np.cos(line.theta), np.sin(line.theta)])
        along = np.array([-normal[1], normal[0]])
        ends = line.segment if line.segment is not None else line.rho * normal + np.outer((-_FAR, _FAR), along)
        found.append((line.kind, np.round(focal * np.asarray(ends) + 0.5 * np.array(size)).astype(int).tolist()))
    return size[0], found


def picture_of(packed: Packed) -> np.ndarray:
    """The picture, uint8 RGB (h, w, 3)."""
    if isinstance(packed, bytes):
        picture = cv2.imdecode(np.frombuffer(packed, np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
        return cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)
    width, lines = packed
    picture = np.full((PICTURE_PX, width, 3), _GROUND, np.uint8)
    for kind, (first, second) in lines:
        cv2.line(picture, first, second, _LINES.get(kind, _OTHER), 2, cv2.LINE_AA)
    return picture
