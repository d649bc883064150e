"""The camera beside the flight: where it stands, and where a point of the world appears in its picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

#: Vertical field of view, and direction from the scene to the camera: azimuth from the wall's outward normal to the
#: vehicle's right, and elevation [deg].
FIELD_DEG, AZIMUTH_DEG, ELEVATION_DEG = 32.0, 55.0, 14.0
#: Rounds of centring; halvings of the distance; least distance of a point in front of the camera [m].
_ROUNDS, _HALVINGS, _CLEAR_M = 4, 24, 0.2
#: Fraction of the picture that everything of interest fills [-]; nearest and farthest position from its middle [m].
FILLED, NEAREST_M, FARTHEST_M = 0.92, 1.0, 9.0


@dataclass(frozen=True)
class OutsideCamera:
    """A pinhole camera with upright picture, in MuJoCo's world (x into the wall, y left, z up)."""

    eye: np.ndarray  # position [m], (3,)
    target: np.ndarray  # point on its axis [m], (3,)
    size: tuple[int, int]  # (width, height) of the picture [px]

    @classmethod
    def framing(cls, points: np.ndarray, size: tuple[int, int]) -> OutsideCamera:
        """The nearest camera in the fixed direction that has all points in its picture.

        Args:
            points: Points that must be visible, MuJoCo's world [m], (N, 3).
            size: (width, height) of the picture [px].
        """
        azimuth, elevation = math.radians(AZIMUTH_DEG), math.radians(ELEVATION_DEG)
        away = np.array(
            [-math.cos(azimuth) * math.cos(elevation), -math.sin(azimuth) * math.cos(elevation), math.sin(elevation)]
        )
        target, distance = 0.5 * (points.min(axis=0) + points.max(axis=0)), FARTHEST_M
        for _ in range(_ROUNDS):  # the middle of the picture moves with the distance
            distance = cls._nearest(points, target, away, size)
            camera = cls(target + distance * away, target, size)
            seen, (right, up, _) = camera.project(points), camera.axes
            column, row = 0.5 * (seen.min(axis=0) + seen.max(axis=0)) - 0.5 * np.array(size)
            target = target + (column * right - row * up) * distance / camera.focal_px
        return cls(target + distance * away, target, size)

    @classmethod
    def _nearest(cls, points: np.ndarray, target: np.ndarray, away: np.ndarray, size: tuple[int, int]) -> float:
        """Distance at which the extent of the points in the picture has the target value [m], by bisection."""
        near, far = NEAREST_M, FARTHEST_M
        for _ in range(_HALVINGS):
            distance = 0.5 * (near + far)
            camera = cls(target + distance * away, target, size)
            visible = ((points - camera.eye) @ camera.axes[2]).max() < -_CLEAR_M
            fits = visible and (np.ptp(camera.project(points), axis=0) <= FILLED * np.array(size)).all()
            near, far = (near, distance) if fits else (distance, far)
        return far

    @property
    def focal_px(self) -> float:
        """Focal length [px]."""
        return 0.5 * self.size[1] / math.tan(math.radians(0.5 * FIELD_DEG))

    @cached_property
    def axes(self) -> np.ndarray:
        """Rows right, up and backward in the world, (3, 3): OpenGL's camera."""
        backward = (self.eye - self.target) / np.linalg.norm(self.eye - self.target)
        right = np.cross((0.0, 0.0, 1.0), backward)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(backward, right), backward])

    @property
    def from_world(self) -> np.ndarray:
        """Homogeneous transform of world points into OpenGL's camera, (4, 4)."""
        transform = np.eye(4)
        transform[:3, :3], transform[:3, 3] = self.axes, -self.axes @ self.eye
        return transform

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixel coordinates (column, row) of world points in front of the camera, (N, 2)."""
        right, up, backward = self.axes @ (np.atleast_2d(points) - self.eye).T
        depth = np.maximum(-backward, 1e-6)
        width, height = self.size
        return np.column_stack((0.5 * width + self.focal_px * right / depth, 0.5 * height - self.focal_px * up / depth))
