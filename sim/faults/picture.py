"""A part of the picture without use: glare, or dirt on the lens."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ibvs_qp.config.settings import setting
from ibvs_qp.measurement import FeatureFrame, LineFeature, RgbdFrame, SensorFrame
from sim.faults.camera import picture_of, with_picture
from sim.faults.fault import FrameFilter, SensorFault
from sim.sensors.edge_view import SHORTEST

#: Width of the soft rim, as a fraction of the ellipse: dirt on the lens is out of focus.
_RIM = 0.5
#: Covered by more than this counts as hidden.
_HALF = 0.5
#: Points at which a line is tested.
_POINTS = 200


@dataclass(frozen=True, kw_only=True)
class PictureCovered(SensorFault):
    """An ellipse with a soft rim covers part of the picture; there is neither depth nor a line in it.

    Places are normalised picture coordinates.
    """

    right: float = setting(0.0, "its centre, to the right of the picture's", low=-2.0, high=2.0)
    down: float = setting(0.0, "its centre, below the picture's", low=-2.0, high=2.0)
    half_width: float = setting(0.12, "its half axis to the right", low=0.01, high=2.0)
    half_height: float = setting(0.12, "its half axis downwards", low=0.01, high=2.0)
    grey: int = setting(255, "its colour: 255 for glare", unit="grey level", low=0, high=255)

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Cover pictures, or cut lines."""
        weights: dict[tuple[int, ...], np.ndarray] = {}

        def covered(frame: SensorFrame) -> SensorFrame:
            picture = picture_of(frame)
            if isinstance(picture, RgbdFrame):
                shape = picture.depth.shape
                if shape not in weights:
                    weights[shape] = self._weights(picture)
                return with_picture(frame, _covered(picture, weights[shape], self.grey))
            if isinstance(picture, FeatureFrame):
                lines = (self._cut(line) for line in picture.lines)
                kept = tuple(line for line in lines if line is not None)
                return with_picture(frame, dataclasses.replace(picture, lines=kept))
            return frame

        return covered

    def hidden(self, x: Any, y: Any) -> np.ndarray:
        """Covered fraction at (x, y), 0..1."""
        radius = np.hypot((x - self.right) / self.half_width, (y - self.down) / self.half_height)
        return np.clip((1.0 - radius) / _RIM + _HALF, 0.0, 1.0)

    def _weights(self, picture: RgbdFrame) -> np.ndarray:
        fx, fy, cx, cy = picture.intrinsics
        v, u = np.indices(picture.depth.shape)
        return self.hidden((u - cx) / fx, (v - cy) / fy).astype(np.float32)

    def _cut(self, line: LineFeature) -> LineFeature | None:
        """The longest piece of a line that is not covered, or None when it is too short to be found."""
        if line.segment is None:
            return line
        start, end = line.segment
        points = start + np.linspace(0.0, 1.0, _POINTS)[:, None] * (end - start)
        clear = self.hidden(points[:, 0], points[:, 1]) < _HALF
        if clear.all():
            return line
        bounds = np.flatnonzero(np.diff(np.concatenate(([0], clear.astype(int), [0]))))
        firsts, lasts = bounds[::2], bounds[1::2] - 1
        if not len(firsts):
            return None
        longest = int(np.argmax(lasts - firsts))
        piece = points[[firsts[longest], lasts[longest]]]
        if np.hypot(*(piece[1] - piece[0])) < SHORTEST:
            return None
        return dataclasses.replace(line, segment=piece)


def _covered(picture: RgbdFrame, weight: np.ndarray, grey: int) -> RgbdFrame:
    colours = picture.rgb + weight[..., None] * (np.float32(grey) - picture.rgb)
    depth = np.where(weight > _HALF, np.float32(0.0), picture.depth)
    return dataclasses.replace(picture, rgb=np.rint(colours).astype(np.uint8), depth=depth)
