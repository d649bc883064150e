"""A predicted line in the view in which it is level, and a fit in that view as a line of the picture."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels import line_tables as t
from ibvs_qp.vision.kernels.compile import inner

#: Pixels of a profile beyond its two sides that must be in the picture.
_MARGIN = 2


@inner
def place_in_view(query: np.ndarray, camera: np.ndarray, height: int, width: int, view: np.ndarray) -> None:
    """Fill a row of views.

    Args:
        query: The line, a row of `line_tables`.
        camera: The camera, a row of `line_tables`.
        height: Of the picture [px].
        width: Of the picture [px].
        view: Filled, a row of `line_tables`.
    """
    fx, fy, cx, cy = camera[t.FX], camera[t.FY], camera[t.CX], camera[t.CY]
    a, b, c = camera[t.PLANE_A], camera[t.PLANE_B], camera[t.PLANE_C]
    rows, columns, row_step, column_step, angle = height, width, width, 1, query[t.THETA]
    upright = abs(math.cos(angle)) > abs(math.sin(angle))
    if upright:
        fx, fy, cx, cy, a, b = fy, fx, cy, cx, b, a
        rows, columns, row_step, column_step, angle = width, height, 1, width, 0.5 * math.pi - angle
    sign = 1.0 if math.sin(angle) > 0.0 else -1.0
    p, q = math.cos(angle) / fx, math.sin(angle) / fy
    view[t.VIEW_UPRIGHT], view[t.VIEW_SIGN] = upright, sign
    view[t.VIEW_ROW_STEP], view[t.VIEW_COLUMN_STEP] = row_step, column_step
    view[t.VIEW_HEIGHT], view[t.VIEW_WIDTH] = rows, columns
    view[t.VIEW_FX], view[t.VIEW_FY], view[t.VIEW_CX], view[t.VIEW_CY] = fx, fy, cx, cy
    view[t.VIEW_SLOPE], view[t.VIEW_LEVEL] = -p / q, (query[t.RHO] + p * cx + q * cy) / q
    view[t.VIEW_FROM], view[t.VIEW_TO] = fx * query[t.FROM] + cx, fx * query[t.TO] + cx
    view[t.VIEW_FIRST], view[t.VIEW_LAST] = max(view[t.VIEW_FROM], 0.0), min(view[t.VIEW_TO], columns - 1.0)
    view[t.VIEW_SEEN_FROM], view[t.VIEW_SEEN_TO] = fx * query[t.SEEN_FROM] + cx, fx * query[t.SEEN_TO] + cx
    view[t.VIEW_BEHIND], view[t.VIEW_POLARITY] = sign * query[t.SURFACE_SIDE] > 0.0, sign * query[t.POLARITY]
    for k in range(3):
        view[t.VIEW_RED + k] = sign * query[t.RED + k]
    view[t.VIEW_U], view[t.VIEW_V], view[t.VIEW_ONE] = a / fx, b / fy, c - a * cx / fx - b * cy / fy


@inner
def finish(
    view: np.ndarray,
    fit: np.ndarray,
    theta: float,
    u: np.ndarray,
    visible: np.ndarray,
    side: int,
    bias: float,
    line: np.ndarray,
) -> None:
    """Fill a row of lines.

    Args:
        view: The view, a row of `line_tables`.
        fit: The fit in it, a row of `line_tables`.
        theta: Predicted angle [rad]: the line's normal is turned to it.
        u: Columns of the profiles [px], (K,).
        visible: Profiles that could be seen, uint8 (K,).
        side: Distance from an edge at which its two sides are looked at [px].
        bias: Standard deviation of the line that no number of profiles makes less [px].
        line: Filled, a row of `line_tables`.
    """
    fx, fy, cx, cy = view[t.VIEW_FX], view[t.VIEW_FY], view[t.VIEW_CX], view[t.VIEW_CY]
    level, slope, center = fit[t.FIT_LEVEL], fit[t.FIT_SLOPE], fit[t.FIT_CENTER]
    first, last = int(fit[t.FIT_FIRST]), int(fit[t.FIT_LAST])
    upright = view[t.VIEW_UPRIGHT] != 0.0
    _polar(view, fit, theta, bias, line)
    v1, v2 = level + slope * (u[first] - center), level + slope * (u[last] - center)
    x1, y1, x2, y2 = (u[first] - cx) / fx, (v1 - cy) / fy, (u[last] - cx) / fx, (v2 - cy) / fy
    line[t.X1], line[t.Y1] = (y1, x1) if upright else (x1, y1)
    line[t.X2], line[t.Y2] = (y2, x2) if upright else (x2, y2)
    line[t.LENGTH] = math.hypot(u[last] - u[first], v2 - v1)
    line[t.END_1] = _end_at(first - 1, view[t.VIEW_FROM] > 0.0, view, fit, u, visible, side)
    line[t.END_2] = _end_at(last + 1, view[t.VIEW_TO] < view[t.VIEW_WIDTH] - 1.0, view, fit, u, visible, side)
    line[t.SHARE], line[t.COUNT] = fit[t.FIT_COUNT] / max(fit[t.FIT_SEEN], 1.0), fit[t.FIT_COUNT]
    line[t.RMS] = fit[t.FIT_RMS]
    for k in range(3):
        line[t.STEP_RED + k] = view[t.VIEW_SIGN] * fit[t.FIT_RED + k]


@inner
def _polar(view: np.ndarray, fit: np.ndarray, reference: float, bias: float, line: np.ndarray) -> None:
    """(rho, theta) of a fit, theta within pi/2 of the reference [rad], and their covariance J diag(variances) J^T."""
    fx, fy, cx, cy = view[t.VIEW_FX], view[t.VIEW_FY], view[t.VIEW_CX], view[t.VIEW_CY]
    level, slope, center = fit[t.FIT_LEVEL], fit[t.FIT_SLOPE], fit[t.FIT_CENTER]
    a, b, c = -slope * fx, fy, -slope * cx + cy + slope * center - level
    length = math.hypot(a, b)
    rho, angle = -c / length, math.atan2(b, a)
    rho_level = 1.0 / length
    rho_slope, angle_slope = (cx - center) / length - c * a * fx / length**3, b * fx / length**2
    if view[t.VIEW_UPRIGHT] != 0.0:
        angle, angle_slope = 0.5 * math.pi - angle, -angle_slope
    if math.cos(angle - reference) < 0.0:
        rho, rho_level, rho_slope, angle = -rho, -rho_level, -rho_slope, angle + math.pi
    turns = np.rint((angle - reference) / (2.0 * math.pi))
    level_variance, slope_variance = fit[t.FIT_LEVEL_VARIANCE] + bias * bias, fit[t.FIT_SLOPE_VARIANCE]
    line[t.LINE_RHO], line[t.LINE_THETA] = rho, angle - 2.0 * math.pi * turns
    line[t.RHO_RHO] = rho_level**2 * level_variance + rho_slope**2 * slope_variance
    line[t.RHO_THETA] = line[t.THETA_RHO] = rho_slope * angle_slope * slope_variance
    line[t.THETA_THETA] = angle_slope**2 * slope_variance


@inner
def _end_at(
    neighbour: int, cut: bool, view: np.ndarray, fit: np.ndarray, u: np.ndarray, visible: np.ndarray, side: int
) -> int:
    """Why a segment ends before a neighbouring profile; ``cut`` is whether no more was looked at on that side."""
    if neighbour < 0 or neighbour >= len(u):
        return t.BY_SPAN if cut else t.BY_PICTURE
    beyond, margin = fit[t.FIT_LEVEL] + fit[t.FIT_SLOPE] * (u[neighbour] - fit[t.FIT_CENTER]), side + _MARGIN
    if not margin <= beyond <= view[t.VIEW_HEIGHT] - 1.0 - margin:
        return t.BY_PICTURE
    return t.BY_END if visible[neighbour] else t.BY_MASK
