"""Errors of a real camera in the sensor model of lines: where its geometry moves a line, how they blur the plane.

Blur, defocus and steps of the exposure have no equivalent: they change a fit's noise, which the model states itself,
by less than the threshold at which perception loses the line. Grown surfaces and a shift of the depth against the
colour have none either: the model reads no picture edge from the depth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from sim.sensors.image_motion import image_velocity
from sim.world.errors import CameraErrors, DepthErrors

#: A line through a segment's points at these fractions of its half length is the least-squares fit of any curve up to
#: the third order (Gauss).
_FIT_AT = 1.0 / math.sqrt(3.0)
#: Depth readings that support a plane: the finest grid of perception, 80 x 60, half of it on the board [-].
PLANE_READINGS = 2400
#: Standard deviation of a rounding error per step, and length of a segment per standard deviation of its points.
_ROUNDING, _SPREAD = 1.0 / math.sqrt(12.0), math.sqrt(12.0)


class LineDefects:
    """Lines and plane as a real camera gives them.

    Args:
        camera: Rolling shutter and distortion.
        depth: Noise and quantisation.
        focal_px: Focal length.
        half_view: Half the field of view to the right and down, normalised, (2,).
        height: Picture height [px].
    """

    def __init__(
        self, camera: CameraErrors, depth: DepthErrors, focal_px: float, half_view: Sequence[float], height: int
    ) -> None:
        self._k1, self._half_width = camera.distortion_k1, half_view[0]
        self._readout_s = camera.rolling_shutter_s * focal_px / (height - 1)  # per normalised length down the picture
        self._noise = depth.noise_relative / math.sqrt(PLANE_READINGS)
        self._step = _ROUNDING * depth.disparity_step_px / (focal_px * depth.baseline_m)
        self.moves_lines = bool(self._k1 or self._readout_s)
        self.blurs_plane = bool(self._noise or self._step)

    def line(self, numbers: Sequence[float], plane: Sequence[float], twist: Sequence[float]) -> list[float]:
        """An edge where rolling shutter and distortion show it.

        Args:
            numbers: `sim.sensors.edge_view.EDGE_NUMBERS`.
            plane: (a, b, c) of the board, 1/Z = a x + b y + c [1/m].
            twist: Of the camera in its axes [m/s, rad/s], (6,).
        """
        seen, x1, y1, x2, y2, rho, theta, side = numbers
        u, v, half_u, half_v = 0.5 * (x1 + x2), 0.5 * (y1 + y2), 0.5 * (x2 - x1), 0.5 * (y2 - y1)
        (u1, v1), (u2, v2) = (
            self._moved(u + part * half_u, v + part * half_v, plane, twist) for part in (-_FIT_AT, _FIT_AT)
        )
        # Turn of the line about the origin, small against the quarter turn at which its normal would flip.
        theta += math.atan2(half_u * (v2 - v1) - half_v * (u2 - u1), half_u * (u2 - u1) + half_v * (v2 - v1))
        rho = 0.5 * ((u1 + u2) * math.cos(theta) + (v1 + v2) * math.sin(theta))
        ends = *self._moved(x1, y1, plane, twist), *self._moved(x2, y2, plane, twist)
        return [seen, *ends, rho, theta, side]

    def plane_sigmas(self, distance: float) -> tuple[float, float]:
        """Standard deviations of the plane's distance [m] and normal [rad] at a distance [m].

        White noise averages over the readings; a rounded disparity is common to all readings of a surface that the
        camera faces. Both tilt the plane over the width of the picture.
        """
        sigma = math.hypot(self._noise * distance, self._step * distance * distance)
        return sigma, sigma * _SPREAD / (2.0 * self._half_width * distance)

    def _moved(self, x: float, y: float, plane: Sequence[float], twist: Sequence[float]) -> tuple[float, float]:
        rate_x, rate_y = image_velocity(x, y, plane, twist)
        time = self._readout_s * y
        x, y = x + time * rate_x, y + time * rate_y
        scale = 1.0 + self._k1 * (x * x + y * y)
        return scale * x, scale * y
