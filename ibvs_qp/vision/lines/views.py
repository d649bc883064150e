"""A predicted line in the view in which it is level, and a fit in that view as a line of the picture."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ibvs_qp.vision.compilation import inner
from ibvs_qp.vision.lines.records import BY_END, BY_MASK, BY_PICTURE, BY_SPAN

#: Pixels of a profile beyond its two sides that must be in the picture.
_MARGIN = 2


class Fit(NamedTuple):
    """A line v = level + slope (u - center) in its view [px], variances of level and slope, and residual [px]."""

    level: float
    slope: float
    center: float
    level_variance: float
    slope_variance: float
    rms: float


class Run(NamedTuple):
    """First and last profile of a line, how many of those between agree, and how many agree or could be seen."""

    first: int
    last: int
    agreeing: int
    seen: int


@inner
def place_in_view(query, pixels, view):
    """Fill a record of `VIEW` from one of `QUERY`."""
    (height, width), (fx, fy, cx, cy), (a, b, c) = pixels.mask.shape, pixels.camera, pixels.plane
    rows, columns, row_step, column_step, angle = height, width, width, 1, query.theta
    upright = abs(math.cos(angle)) > abs(math.sin(angle))
    if upright:
        fx, fy, cx, cy, a, b = fy, fx, cy, cx, b, a
        rows, columns, row_step, column_step, angle = width, height, 1, width, 0.5 * math.pi - angle
    sign = 1.0 if math.sin(angle) > 0.0 else -1.0
    p, q = math.cos(angle) / fx, math.sin(angle) / fy
    view.upright, view.sign, view.row_step, view.column_step, view.height = upright, sign, row_step, column_step, rows
    view.fx, view.fy, view.cx, view.cy = fx, fy, cx, cy
    view.slope, view.level = -p / q, (query.rho + p * cx + q * cy) / q
    first, last = fx * query.span[0] + cx, fx * query.span[1] + cx
    view.first, view.last = max(first, 0.0), min(last, columns - 1.0)
    view.cut_first, view.cut_last = first > 0.0, last < columns - 1.0
    view.seen[0], view.seen[1] = fx * query.seen[0] + cx, fx * query.seen[1] + cx
    view.surface_behind, view.polarity = sign * query.surface_side > 0.0, sign * query.polarity
    for k in range(3):
        view.step[k] = sign * query.step[k]
    view.plane[0], view.plane[1], view.plane[2] = a / fx, b / fy, c - a * cx / fx - b * cy / fy


@inner
def finish(view, fit, run, strip, search, theta, line):
    """Fill a record of `LINE`, its normal turned to a predicted angle [rad]."""
    u, first, last = strip.u, run.first, run.last
    _polar(view, fit, theta, search.bias, line)
    v1, v2 = fit.level + fit.slope * (u[first] - fit.center), fit.level + fit.slope * (u[last] - fit.center)
    along, across = (1, 0) if view.upright else (0, 1)
    line.segment[0, along], line.segment[0, across] = (u[first] - view.cx) / view.fx, (v1 - view.cy) / view.fy
    line.segment[1, along], line.segment[1, across] = (u[last] - view.cx) / view.fx, (v2 - view.cy) / view.fy
    line.length_px = math.hypot(u[last] - u[first], v2 - v1)
    margin = search.side + _MARGIN
    line.ends[0] = _end_at(first - 1, view.cut_first, view, fit, strip, margin)
    line.ends[1] = _end_at(last + 1, view.cut_last, view, fit, strip, margin)
    line.inlier_share, line.count, line.rms_px = run.agreeing / max(run.seen, 1.0), run.agreeing, fit.rms


@inner
def _polar(view, fit, reference, bias, line):
    """(rho, theta) of a fit, theta within pi/2 of the reference [rad], and their covariance J diag(variances) J^T."""
    fx, fy, cx, cy = view.fx, view.fy, view.cx, view.cy
    a, b, c = -fit.slope * fx, fy, -fit.slope * cx + cy + fit.slope * fit.center - fit.level
    length = math.hypot(a, b)
    rho, angle = -c / length, math.atan2(b, a)
    rho_level = 1.0 / length
    rho_slope, angle_slope = (cx - fit.center) / length - c * a * fx / length**3, b * fx / length**2
    if view.upright:
        angle, angle_slope = 0.5 * math.pi - angle, -angle_slope
    if math.cos(angle - reference) < 0.0:
        rho, rho_level, rho_slope, angle = -rho, -rho_level, -rho_slope, angle + math.pi
    turns = np.rint((angle - reference) / (2.0 * math.pi))
    level_variance, slope_variance = fit.level_variance + bias * bias, fit.slope_variance
    line.rho, line.theta = rho, angle - 2.0 * math.pi * turns
    line.covariance[0, 0] = rho_level**2 * level_variance + rho_slope**2 * slope_variance
    line.covariance[0, 1] = line.covariance[1, 0] = rho_slope * angle_slope * slope_variance
    line.covariance[1, 1] = angle_slope**2 * slope_variance


@inner
def _end_at(neighbour, cut, view, fit, strip, margin):
    """Why a segment ends before a neighbouring profile; `cut` is whether no more was looked at on that side."""
    if neighbour < 0 or neighbour >= len(strip.u):
        return BY_SPAN if cut else BY_PICTURE
    beyond = fit.level + fit.slope * (strip.u[neighbour] - fit.center)
    if not margin <= beyond <= view.height - 1.0 - margin:
        return BY_PICTURE
    return BY_END if strip.visible[neighbour] else BY_MASK
