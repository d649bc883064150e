"""Lines of the sensor model: their noise, and a line moved by some of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.measurement import LineFeature

#: Noise of rho [-] and theta [rad] of one line: a good sub-pixel fit (0.1 px, 0.06 deg) at 640x480.
SIGMA_RHO, SIGMA_THETA = 2e-4, 1e-3
_COVARIANCE = np.diag([SIGMA_RHO**2, SIGMA_THETA**2])
_COVARIANCE.flags.writeable = False  # shared by all lines


def seen_line(
    numbers: Sequence[float], role: str, kind: str, track: int, stamp_ns: int, noise: Sequence[float] = (0.0, 0.0)
) -> LineFeature:
    """The line feature of an edge that is seen, with the covariance of a good fit.

    Args:
        numbers: `sim.sensors.edge_view.EDGE_NUMBERS`.
        role: "horizontal" or "vertical".
        kind: "board" or "paint".
        track: Track identity.
        stamp_ns: Time of capture.
        noise: Of rho and theta in units of their sigmas.
    """
    _, x1, y1, x2, y2, rho, theta, side = numbers
    rho, theta = rho + SIGMA_RHO * noise[0], theta + SIGMA_THETA * noise[1]
    return LineFeature(
        rho=rho,
        theta=theta,
        covariance=_COVARIANCE,
        role=role,
        weight=1.0,
        stamp_ns=stamp_ns,
        track_id=track,
        segment=_on_line(x1, y1, x2, y2, rho, theta),
        surface_side=1 if side > 0.0 else -1,
        kind=kind,
    )


def _on_line(x1: float, y1: float, x2: float, y2: float, rho: float, theta: float) -> np.ndarray:
    """End points moved onto a line, (2, 2)."""
    c, s = math.cos(theta), math.sin(theta)
    near, far = x1 * c + y1 * s - rho, x2 * c + y2 * s - rho
    return np.array((x1 - near * c, y1 - near * s, x2 - far * c, y2 - far * s)).reshape(2, 2)


def moved_line(line: LineFeature, rho: float, theta: float) -> LineFeature:
    """The line with rho and theta changed by the given amounts, its end points moved onto it."""
    rho, theta = line.rho + rho, line.theta + theta
    segment = line.segment
    if segment is not None:
        (x1, y1), (x2, y2) = segment.tolist()
        segment = _on_line(x1, y1, x2, y2, rho, theta)
    return dataclasses.replace(line, rho=rho, theta=theta, segment=segment)
