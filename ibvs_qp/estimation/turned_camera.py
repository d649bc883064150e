"""Lines and planes of a camera with any mount, in the axes of one that looks along +x.

Plain numbers in a fixed order of sums: the C library (``pack.c``) has the same bits.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence

import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.field_of_view import camera_rotation
from ibvs_qp.config.settings import stated
from ibvs_qp.frames import Rotation3, rotate
from ibvs_qp.measurement import FeatureFrame, LineFeature, Measurement
from ibvs_qp.validation.geometry import INVERSE_DEPTH_MIN, LINE_BOUND

#: Reason of a refusal: the object lies beside or behind a camera that looks along +x.
OUT_OF_VIEW = "not in front of a camera that looks along +x"

Plane = tuple[float, float, float, float]


def straightened(config: ControllerConfig) -> ControllerConfig:
    """Configuration of a controller whose measurements have their features in C already, as a pilot's.

    The bounds of the view remain those of the turned camera.
    """
    if not any(config.vehicle.camera_turn_deg):
        return config
    vehicle = dataclasses.replace(config.vehicle, camera_turn_deg=(0.0, 0.0, 0.0))
    return dataclasses.replace(config, vehicle=vehicle, limits=stated(config.limits))


class TurnedCamera:
    r"""Rotates features from the real camera to the camera frame C of `ibvs_qp.frames`.

    A line is the plane through the camera :math:`m \cdot X = 0` with :math:`m = (\cos\theta, \sin\theta, -\rho)`, and
    the wall is :math:`n \cdot X = d`; with :math:`X_C = R X`, :math:`m_C = R m` and :math:`n_C = R n`.

    Attributes:
        rotation: R, (3, 3).
        straight: Whether it is the identity, so that nothing changes.

    Args:
        turn_deg: Rotation vector from a camera that looks along +x to the real one, in B [deg], (3,).
    """

    def __init__(self, turn_deg: Sequence[float]) -> None:
        self.rotation = camera_rotation(turn_deg)
        self._rows: Rotation3 = tuple(map(tuple, self.rotation.tolist()))  # type: ignore[assignment]
        self.straight = not any(turn_deg)

    def features(self, frame: FeatureFrame, rejected: list[str]) -> FeatureFrame:
        """Result of perception in C; rejects parts out of view there by name."""
        if self.straight:
            return frame
        lines, plane = self._lines(frame.lines, rejected), self._plane(frame.plane, rejected)
        return dataclasses.replace(frame, lines=lines, plane=plane)

    def measurement(self, measurement: Measurement, rejected: list[str]) -> Measurement:
        """A measurement with its lines and its plane in C; rejects parts out of view there by name."""
        if self.straight:
            return measurement
        lines, plane = self._lines(measurement.lines, rejected), self._plane(measurement.plane, rejected)
        return dataclasses.replace(measurement, lines=lines, plane=plane)

    def _lines(self, lines: Iterable[LineFeature], rejected: list[str]) -> tuple[LineFeature, ...]:
        turned = [self._line(line) for line in lines]
        if lost := turned.count(None):
            rejected.append(f"lines: {lost} {OUT_OF_VIEW}")
        return tuple([line for line in turned if line is not None])

    def _plane(self, plane: Sequence[float] | None, rejected: list[str]) -> Plane | None:
        if plane is None:
            return None
        a, b, c = rotate(self._rows, plane[:3])
        if c < INVERSE_DEPTH_MIN * -plane[3]:
            rejected.append(f"plane: {OUT_OF_VIEW}")
            return None
        return a, b, c, float(plane[3])

    def _line(self, line: LineFeature) -> LineFeature | None:
        cos, sin = math.cos(line.theta), math.sin(line.theta)
        x, y, z = rotate(self._rows, (cos, sin, -line.rho))
        length = math.sqrt(x * x + y * y)
        if not abs(z) <= LINE_BOUND * length:
            return None
        rates = rotate(self._rows, (0.0, 0.0, -1.0)), rotate(self._rows, (-sin, cos, 0.0))  # by rho, by theta
        turned_rho = [(z * ((x * dx + y * dy) / (length * length)) - dz) / length for dx, dy, dz in rates]
        turned_theta = [(x * dy - y * dx) / (length * length) for dx, dy, _ in rates]
        (variance, covariance), (_, theta_variance) = line.covariance.tolist()
        jacobian = turned_rho, turned_theta
        rows = [(u * variance + v * covariance, u * covariance + v * theta_variance) for u, v in jacobian]
        segment = line.segment
        if segment is not None:
            ends = [rotate(self._rows, (*end, 1.0)) for end in segment.tolist()]
            seen = all([depth > 0.0 for *_, depth in ends])
            segment = np.array([(right / depth, down / depth) for right, down, depth in ends]) if seen else None
        return dataclasses.replace(
            line,
            rho=-z / length,
            theta=math.atan2(y, x),
            covariance=np.array([[u * a + v * b for a, b in rows] for u, v in jacobian]),
            segment=segment,
        )
