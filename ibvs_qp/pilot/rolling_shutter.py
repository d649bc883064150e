"""Lines of a picture whose rows are exposed in sequence, as at the picture's stamp."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.frames import align_line, camera_twist_matrix
from ibvs_qp.measurement import FeatureFrame, LineFeature, RgbdFrame
from ibvs_qp.vision.picture.camera import Lens

#: Points of a segment from its middle, per half of its length, whose chord is the least-squares line of a bow.
_PLACES = np.array((-1.0, 1.0)) / math.sqrt(3.0)


class RollingShutter:
    """Carries two points of every line from the time of their own rows to the stamp, along the motion of the picture.

    Row v is exposed at stamp + (v - cy) / (H - 1) * readout_s. The correction is of first order in the readout time.

    Args:
        readout_s: First to last row [s]; 0 changes nothing.
        lens: Lens and mount of the camera, for the row of the real picture in which a point lies.
        camera_position: Centre of the camera in B [m], (3,).
    """

    def __init__(self, readout_s: float, lens: Lens, camera_position: np.ndarray) -> None:
        self._readout_s, self._lens, self._to_camera = readout_s, lens, camera_twist_matrix(camera_position)

    def features(
        self,
        features: FeatureFrame,
        picture: RgbdFrame,
        plane: Sequence[float] | None,
        velocity: np.ndarray | None,
        rate: Sequence[float],
    ) -> FeatureFrame:
        """The features with all lines at the stamp; a line without a segment stays as it is.

        Args:
            features: Of the rectified picture.
            picture: That picture; its intrinsics and height are those of the real one.
            plane: (A, B, C, D) of the wall in C, or None: then the rotation alone counts.
            velocity: Of the centre of mass in B at capture [m/s], (3,), or None.
            rate: Angular velocity in B at capture [rad/s], (3,).
        """
        if not (self._readout_s and features.lines):
            return features
        twist = self._to_camera @ np.concatenate((np.zeros(3) if velocity is None else velocity, rate))
        inverse = np.zeros(3) if plane is None else np.asarray(plane[:3], float) / -plane[3]
        lines = tuple([self._line(line, picture, inverse, twist) for line in features.lines])
        return dataclasses.replace(features, lines=lines)

    def _line(self, line: LineFeature, picture: RgbdFrame, inverse: np.ndarray, twist: np.ndarray) -> LineFeature:
        if line.segment is None:
            return line
        middle, half = line.segment.mean(axis=0), 0.5 * (line.segment[1] - line.segment[0])
        places = middle + _PLACES[:, None] * half
        places = places + (line.rho - places @ (normal := _normal(line.theta)))[:, None] * normal  # onto the line
        moved = places + self._shift(places, picture, inverse, twist)
        along = moved[1] - moved[0]
        theta = math.atan2(along[0], -along[1])
        rho = float(moved[0] @ _normal(theta))
        if not math.isfinite(rho):
            return line
        rho, theta = align_line(rho, theta, line.theta)
        segment = line.segment + self._shift(line.segment, picture, inverse, twist)
        return dataclasses.replace(line, rho=rho, theta=theta, segment=segment)

    def _shift(self, points: np.ndarray, picture: RgbdFrame, inverse: np.ndarray, twist: np.ndarray) -> np.ndarray:
        """From where points were exposed to where they are at the stamp, normalised, (n, 2)."""
        rows = self._lens.pixels(points, picture.intrinsics)[:, 1]
        after_s = (rows - picture.intrinsics[3]) / (picture.rgb.shape[0] - 1) * self._readout_s
        (x, y), (vx, vy, vz, wx, wy, wz) = points.T, twist
        per_depth = inverse[0] * x + inverse[1] * y + inverse[2]
        ahead = wx * y - wy * x + vz * per_depth
        motion = np.stack((x * ahead - vx * per_depth - wy + wz * y, y * ahead - vy * per_depth - wz * x + wx), axis=-1)
        return -after_s[:, None] * motion


def _normal(theta: float) -> np.ndarray:
    return np.array((math.cos(theta), math.sin(theta)))
