"""Curvature of the wall from the depth that is left over its tangent plane, filtered over pictures."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.measurement import LARGEST_CURVATURE
from ibvs_qp.vision.picture.layout import CoarseGrid
from ibvs_qp.vision.picture.unrolled import principal, wall_axes
from ibvs_qp.vision.surface.plane import PlaneEstimate

#: A wall counts as curved from this curvature on, and as flat again below the other [1/m]: at 1/20 a picture of 0.5 m
#: shows a bow of half a pixel.
CURVED, FLAT = 0.05, 0.03
#: And from so many standard deviations on.
CERTAIN = 5.0
#: Samples farther from the surface belong to something else, fraction of depth: as much as a wall 2 cm behind a board.
GATE = 0.03
#: Ratio of the variance of curvature under correlated noise (20 px, samples every 16 px) to that of white noise.
CORRELATED = 4.0
#: Change of the curvature along a wall, standard deviation per root of time [1/m/sqrt(s)]: 1/30 within 10 s.
WANDER = 0.01
#: Least samples, and variance before the first picture [1/m^2].
LEAST, UNKNOWN = 60, 1.0


class WallCurvature:
    """Kalman filter of the curvature, whose measurement is the remaining curvature of unrolled pictures.

    Attributes:
        value: Entries (right right, right down, down down) [1/m], (3,), > 0 where the wall bulges towards the camera.
        covariance: Their covariance, (3, 3).
        unrolled_by: Curvature by which the last picture was unrolled, (3,), a cylinder's; None before a flat wall.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start again as new: flat, and unknown."""
        self.value, self.covariance, self._curved = np.zeros(3), UNKNOWN * np.eye(3), False
        self.unrolled_by: np.ndarray | None = None

    def seen(self) -> np.ndarray | None:
        """The curvature by which to unroll the next picture, (3,), of a cylinder; None before a flat wall."""
        size = abs(principal(self.value)[0])
        sigma = math.sqrt(float(self.covariance[[0, 2], [0, 2]].max()))
        self._curved = size > max(FLAT if self._curved else CURVED, CERTAIN * sigma)
        if not self._curved:
            return self.flat()
        kappa, angle = principal(self.value)
        kappa = min(max(kappa, -LARGEST_CURVATURE), LARGEST_CURVATURE)
        c, s = math.cos(angle), math.sin(angle)
        self.unrolled_by = kappa * np.array((c * c, c * s, s * s))
        return self.unrolled_by

    def flat(self) -> None:
        """The next picture is not unrolled."""
        self.unrolled_by = None

    def update(self, grid: CoarseGrid, inverse: np.ndarray, plane: PlaneEstimate, interval_s: float) -> None:
        """Take in a picture.

        Args:
            grid: Where the samples lie.
            inverse: 1/Z of the samples of the unrolled picture [1/m], 0 where absent, (rows, columns).
            plane: The surface fitted to them.
            interval_s: Time since the picture before [s].
        """
        self.covariance = self.covariance + WANDER**2 * interval_s * np.eye(3)
        design, samples = grid.corners, inverse.reshape(-1)
        model = design @ plane.inverse_depth
        around = plane.component.reshape(-1)
        near = around & (samples > 0.0) & (model > 0.0)
        near &= np.abs(np.divide(model, samples, out=np.ones_like(model), where=near) - 1.0) < GATE
        chosen = np.flatnonzero(near)
        if len(chosen) < LEAST:
            return
        normal = -plane.normal
        right, down = wall_axes(normal)
        rays, depth = design[chosen], 1.0 / model[chosen]
        left = (rays @ normal) * (1.0 / samples[chosen] - depth)  # behind the tangent plane [m]
        places = rays * depth[:, None]
        r, d = places @ right, places @ down
        r, d = r - r.mean(), d - d.mean()
        columns = np.column_stack((np.ones_like(r), r, d, 0.5 * r * r, r * d, 0.5 * d * d))
        information = columns.T @ columns
        if np.linalg.cond(information) > 1e12:
            return
        spread = np.linalg.inv(information)
        solved = spread @ (columns.T @ left)
        residual = left - columns @ solved
        variance = float(residual @ residual) / (len(chosen) - 6.0)
        noise = CORRELATED * variance * spread[3:, 3:]
        removed = np.zeros(3) if self.unrolled_by is None else self.unrolled_by
        gain = self.covariance @ np.linalg.inv(self.covariance + noise)
        self.value = self.value + gain @ (removed + solved[3:] - self.value)
        self.covariance = self.covariance - gain @ self.covariance
