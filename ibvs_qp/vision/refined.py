"""A fitted line: from pixels of a strip to (rho, theta) with covariance, segment and the reasons of its ends."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.frames import align_line
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.picture import normalise
from ibvs_qp.vision.profiles import Strips
from ibvs_qp.vision.query import LineView
from ibvs_qp.vision.robust import LineFits

_NO_SIDES, _NO_PIXELS = np.zeros((2, 0, 3), np.uint8), np.zeros((0, 2))


@dataclass(frozen=True, kw_only=True)
class RefinedLine:
    """A line fitted to the picture.

    Attributes:
        rho: Distance from the image centre, normalised.
        theta: Angle of the normal, within pi/2 of the prediction's [rad].
        covariance: Of (rho, theta), (2, 2).
        segment: Visible end points, normalised, (2, 2), along growing u (level lines) or v (upright ones).
        ends: Why the segment ends there: "picture", "mask", "span" or "end" (it really ends).
        inlier_share: Share of the visible profiles within the segment that agree.
        rms_px: Residual of the agreeing profiles [px].
        length_px: Length of the segment [px].
        step: Colour behind the line minus colour before it, along the normal, (3,).
        sides: Colours at the agreeing profiles before and behind the line, along the normal, (2, n, 3); empty unless
            asked for.
        pixels: Places of the agreeing profiles, (n, 2) [px]; empty unless asked for.
    """

    rho: float
    theta: float
    covariance: np.ndarray
    segment: np.ndarray
    ends: tuple[str, str]
    inlier_share: float
    rms_px: float
    length_px: float
    step: np.ndarray
    sides: np.ndarray
    pixels: np.ndarray


@dataclass
class Fits:
    """Results of a batch of L lines with K profiles, each in its own view.

    Attributes:
        lines: The fitted lines.
        support: Profiles that agree, bool (L, K).
        visible: Profiles that could be seen, bool (L, K).
        runs: First and last supporting profile, (L).
        steps: Colour behind minus colour before, along +v, (L, 3).
        alive: Whether there is a line at all, bool (L,).
    """

    lines: LineFits
    support: np.ndarray
    visible: np.ndarray
    runs: list[tuple[int, int]]
    steps: np.ndarray
    alive: np.ndarray


def finish_line(
    index: int, fits: Fits, strips: Strips, sides: tuple[np.ndarray, np.ndarray] | None, config: LineConfig
) -> RefinedLine | None:
    """Turn one fit of a batch into a normalised line with covariance and segment; None if it lies too far off."""
    view, lines, (first, last) = strips.views[index], fits.lines, fits.runs[index]
    level, slope, center = float(lines.level[index]), float(lines.slope[index]), float(lines.center[index])
    variance = float(lines.level_variance[index]) + (config.bias_px * view.view.scale) ** 2
    rho, theta, covariance = _polar(view, level, slope, center, variance, float(lines.slope_variance[index]))
    if abs(rho) > config.rho_max:
        return None
    u_first, u_last = float(strips.u[index, first]), float(strips.u[index, last])
    v_first, v_last = level + slope * (u_first - center), level + slope * (u_last - center)
    segment = normalise(np.array([[u_first, v_first], [u_last, v_last]]), view.view.intrinsics)
    support, seen = fits.support[index], fits.visible[index, first : last + 1]
    count = int(np.count_nonzero(support))
    beside, pixels = _NO_SIDES, _NO_PIXELS
    if sides is not None:
        u = strips.u[index, support].astype(float)
        pixels = np.column_stack((u, level + slope * (u - center)))
        pixels = pixels[:, ::-1].copy() if view.upright else pixels
        beside = np.stack((sides[0][index, support], sides[1][index, support])[:: view.sign])
    return RefinedLine(
        rho=rho,
        theta=theta,
        covariance=covariance,
        segment=segment[:, ::-1].copy() if view.upright else segment,
        ends=_end_reasons(index, fits, strips),
        inlier_share=count / max(int(np.count_nonzero(seen | support[first : last + 1])), 1),
        rms_px=float(lines.rms[index]),
        length_px=math.hypot(u_last - u_first, v_last - v_first),
        step=view.sign * fits.steps[index],
        sides=beside,
        pixels=pixels,
    )


def _polar(
    view: LineView, level: float, slope: float, center: float, level_variance: float, slope_variance: float
) -> tuple[float, float, np.ndarray]:
    """(rho, theta) of v = level + slope (u - center) and their covariance J diag(variances) J^T."""
    fx, fy, cx, cy = view.view.intrinsics
    a, b, c = -slope * fx, fy, -slope * cx + cy + slope * center - level
    length = math.hypot(a, b)
    rho, angle = -c / length, math.atan2(b, a)
    rho_slope = (cx - center) / length - c * a * fx / length**3
    angle_slope = b * fx / length**2
    if view.upright:
        angle, angle_slope = 0.5 * math.pi - angle, -angle_slope
    aligned, theta = align_line(rho, angle, view.query.theta)
    rho_level = 1.0 / length
    if aligned != rho:
        rho_level, rho_slope = -rho_level, -rho_slope
    cross = rho_slope * angle_slope * slope_variance
    rho_variance = rho_level**2 * level_variance + rho_slope**2 * slope_variance
    return aligned, theta, np.array([[rho_variance, cross], [cross, angle_slope**2 * slope_variance]])


def _end_reasons(index: int, fits: Fits, strips: Strips) -> tuple[str, str]:
    """Why the segment ends at either end."""
    view, lines, (first, last) = strips.views[index], fits.lines, fits.runs[index]
    profiles, margin = strips.u.shape[1], strips.side + 2
    reasons = []
    for neighbour, cut in ((first - 1, view.columns[0] > 0.0), (last + 1, view.columns[1] < view.view.width - 1.0)):
        if not 0 <= neighbour < profiles:
            reasons.append("span" if cut else "picture")
            continue
        beyond = lines.level[index] + lines.slope[index] * (strips.u[index, neighbour] - lines.center[index])
        outside = not margin <= beyond <= view.view.height - 1.0 - margin
        reasons.append("picture" if outside else ("end" if fits.visible[index, neighbour] else "mask"))
    return reasons[0], reasons[1]
