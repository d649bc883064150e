"""A straight edge in the world as a line feature of the picture."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.frames import align_line
from ibvs_qp.made import made
from ibvs_qp.measurement import HORIZONTAL, LineFeature

#: Noise of rho [-] and theta [rad] of one line: a good sub-pixel fit (0.1 px, 0.06 deg) at 640x480.
SIGMA_RHO, SIGMA_THETA = 2e-4, 1e-3
_COVARIANCE = np.diag([SIGMA_RHO**2, SIGMA_THETA**2])
_COVARIANCE.flags.writeable = False  # shared by all lines
#: Nearest depth that is seen [m].
NEAR_M = 0.05
#: Shortest visible piece that counts as a line, normalised (31 px at 640x480).
_SHORTEST = 0.05


def visible_segment(ends: Sequence[Sequence[float]], half_view: Sequence[float]) -> np.ndarray | None:
    """The part of a straight edge inside the field of view.

    Args:
        ends: Its end points in camera coordinates [m], (2, 3).
        half_view: Half the field of view to the right and down, normalised, (2,).

    Returns:
        Normalised end points (2, 2), or None where too little of it is seen.
    """
    low, high = 0.0, 1.0
    (x0, y0, z0), (x1, y1, z1) = ends
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    right, down = half_view
    for value, rate in (
        (z0 - NEAR_M, dz),
        (right * z0 + x0, right * dz + dx),
        (right * z0 - x0, right * dz - dx),
        (down * z0 + y0, down * dz + dy),
        (down * z0 - y0, down * dz - dy),
    ):
        if abs(rate) < 1e-12:
            if value < 0.0:
                return None
        elif rate > 0.0:
            low = max(low, -value / rate)
        else:
            high = min(high, -value / rate)
    if low >= high:
        return None
    near, far = z0 + low * dz, z0 + high * dz
    x1, y1, x2, y2 = (x0 + low * dx) / near, (y0 + low * dy) / near, (x0 + high * dx) / far, (y0 + high * dy) / far
    return np.array(((x1, y1), (x2, y2))) if math.hypot(x2 - x1, y2 - y1) >= _SHORTEST else None


def projected_line(
    segment: np.ndarray | None, surface: Sequence[float], role: str, kind: str, track: int, stamp_ns: int
) -> LineFeature | None:
    """The line feature through a segment, with the covariance of a good fit.

    Args:
        segment: Normalised end points (2, 2), or None: no line.
        surface: A point on the working surface beside the edge, in camera coordinates [m], (3,).
        role: "horizontal" or "vertical".
        kind: "board" or "paint".
        track: Track identity.
        stamp_ns: Time of capture.
    """
    if segment is None:
        return None
    (x1, y1), (x2, y2) = segment.tolist()
    theta = math.atan2(x1 - x2, y2 - y1)
    rho = x1 * math.cos(theta) + y1 * math.sin(theta)
    rho, theta = align_line(rho, theta, 0.5 * math.pi if role == HORIZONTAL else 0.0)
    x, y, z = surface
    side = x * math.cos(theta) + y * math.sin(theta) - rho * z  # times the point's depth, which is positive
    return made(
        LineFeature,
        rho=rho,
        theta=theta,
        covariance=_COVARIANCE,
        role=role,
        weight=1.0,
        stamp_ns=stamp_ns,
        track_id=track,
        segment=segment,
        surface_side=1 if side > 0.0 else -1,
        kind=kind,
    )


def fitted_ends(points: np.ndarray) -> tuple[tuple[float, float], tuple[float, float]]:
    """Least-squares line up(along) through points (n, 2), as (along, up) of its two ends."""
    along, up = points.T
    middle, height = float(np.add.reduce(along)) / len(along), float(np.add.reduce(up)) / len(up)
    away = along - middle
    slope = float(away @ up) / float(away @ away)
    first, last = along.item(0), along.item(-1)
    return (first, last), (height + slope * (first - middle), height + slope * (last - middle))


def moved_line(line: LineFeature, rho: float, theta: float) -> LineFeature:
    """The line with rho and theta changed by the given amounts, its end points moved onto it."""
    rho, theta = line.rho + rho, line.theta + theta
    segment = line.segment
    if segment is not None:
        c, s = math.cos(theta), math.sin(theta)
        away = [(x, y, x * c + y * s - rho) for x, y in segment.tolist()]
        segment = np.array([(x - gap * c, y - gap * s) for x, y, gap in away])
    return made(LineFeature, **(line.__dict__ | {"rho": rho, "theta": theta, "segment": segment}))
