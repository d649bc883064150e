"""How lines and planes look after the camera has turned and moved."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA, align_line

#: Least share of the distance to a surface that is left after a motion.
_LEAST_LEFT = 0.05


@dataclass(frozen=True)
class CameraMotion:
    """Motion between two pictures: P_before = rotation @ P_now + translation, in camera frames.

    Attributes:
        rotation: Now to before, (3, 3).
        translation: Camera centre now, in the frame before [m], (3,).
    """

    rotation: np.ndarray
    translation: np.ndarray

    @classmethod
    def of_body(
        cls, rotation_vector: np.ndarray, velocity: np.ndarray | None, interval_s: float, camera_position: np.ndarray
    ) -> CameraMotion:
        """Motion of the camera from that of the body.

        Args:
            rotation_vector: Turn of the body from before to now, in B [rad], (3,).
            velocity: Velocity of the centre of mass in B [m/s], (3,), or None for none.
            interval_s: Time between the pictures [s].
            camera_position: Camera centre in B [m], (3,).
        """
        turn = cv2.Rodrigues(np.asarray(rotation_vector, float))[0]
        moved = turn @ camera_position - camera_position
        if velocity is not None:
            moved = moved + np.asarray(velocity, float) * interval_s
        return cls(R_BODY_CAMERA.T @ turn @ R_BODY_CAMERA, R_BODY_CAMERA.T @ moved)

    def plane(self, inverse_depth: np.ndarray) -> np.ndarray:
        """(a, b, c) of the same surface now: R^T N / (1 - N t)."""
        remaining = 1.0 - float(inverse_depth @ self.translation)
        return self.rotation.T @ inverse_depth / max(remaining, _LEAST_LEFT)

    @cached_property
    def _numbers(self) -> tuple[list[list[float]], list[float]]:
        return self.rotation.tolist(), self.translation.tolist()

    def line(self, rho: float, theta: float, inverse_depth: np.ndarray | None) -> tuple[float, float]:
        """The same line now; translation counts only where the line's plane is known."""
        (r, s, t), (tx, ty, tz) = self._numbers  # rows of the rotation; plain numbers, as there are only three of each
        x, y, z = math.cos(theta), math.sin(theta), -rho
        if inverse_depth is not None:
            # before^T (R + t plane^T) with the plane now, plane = R^T N / (1 - N t)
            nx, ny, nz = inverse_depth.tolist()
            gain = (x * tx + y * ty + z * tz) / max(1.0 - nx * tx - ny * ty - nz * tz, _LEAST_LEFT)
            x, y, z = x + gain * nx, y + gain * ny, z + gain * nz
        a, b, c = (x * r[k] + y * s[k] + z * t[k] for k in range(3))
        length = math.hypot(a, b)
        return (rho, theta) if length < 1e-9 else align_line(-c / length, math.atan2(b, a), theta)
