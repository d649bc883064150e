"""A fitted line: from pixels of a strip to (rho, theta) with covariance, segment and the reasons of its ends."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.frames import align_line
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.lines.fits import Fits, LineFit, Profiles
from ibvs_qp.vision.lines.query import LineView

#: Signs of the covariance of (rho, theta) where rho changes its sign.
_REVERSED = np.array([[1.0, -1.0], [-1.0, 1.0]])
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

    def aligned(self, theta: float) -> RefinedLine:
        """The same line with its normal within 90 degrees of an angle [rad]."""
        if math.cos(self.theta - theta) >= 0.0:
            return self
        rho, angle = align_line(self.rho, self.theta, theta)
        return dataclasses.replace(
            self,
            rho=rho,
            theta=angle,
            covariance=self.covariance * _REVERSED,
            step=-self.step,
            sides=self.sides[::-1],
        )


def finish_lines(
    fits: Fits, profiles: Profiles, sides: np.ndarray | None, config: LineConfig
) -> list[RefinedLine | None]:
    """Turn the fits of a batch into normalised lines; None for those that are none or lie too far off.

    Args:
        fits: The fits.
        profiles: Where their profiles lie.
        sides: Colours before and behind every line at its profiles, uint8 (2, L, K, 3), or None.
        config: Settings.
    """
    result: list[RefinedLine | None] = []
    for k, alive in enumerate(fits.alive):
        if not alive:
            result.append(None)
            continue
        beside = (_NO_SIDES, _NO_PIXELS) if sides is None else _contents(k, fits, profiles, sides)
        result.append(_finish(profiles, k, fits, beside, config))
    return result


def _finish(
    strips: Profiles,
    index: int,
    fits: Fits,
    beside: tuple[np.ndarray, np.ndarray],
    config: LineConfig,
) -> RefinedLine | None:
    view, line, run, step = strips.views[index], fits.lines[index], fits.runs[index], fits.steps[index]
    variance = line.level_variance + (config.bias_px * view.view.scale) ** 2
    rho, theta, covariance = _polar(view, line.level, line.slope, line.center, variance, line.slope_variance)
    if abs(rho) > config.rho_max:
        return None
    row = strips.u[index]
    ends = [(u, line.level + line.slope * (u - line.center)) for u in (row.item(run[0]), row.item(run[1]))]
    fx, fy, cx, cy = view.view.intrinsics
    normal = [((along - cx) / fx, (across - cy) / fy) for along, across in ends]
    (x, y, z), sign = step, view.sign
    return RefinedLine(
        rho=rho,
        theta=theta,
        covariance=covariance,
        segment=np.array([(y, x) for x, y in normal] if view.upright else normal),
        ends=_end_reasons(strips, index, run, line, fits),
        inlier_share=fits.count[index] / max(fits.seen[index], 1),
        rms_px=line.rms,
        length_px=math.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]),
        step=np.array((sign * x, sign * y, sign * z)),
        sides=beside[0],
        pixels=beside[1],
    )


def _contents(index: int, fits: Fits, strips: Profiles, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Colours on both sides of a line at its profiles, (2, n, 3), and the places of these, (n, 2) [px]."""
    view, line, held = strips.views[index], fits.lines[index], fits.support[index].nonzero()[0]
    u = strips.u[index].take(held)
    pixels = np.empty((len(held), 2))
    pixels[:, int(view.upright)], pixels[:, 1 - int(view.upright)] = u, line.level + line.slope * (u - line.center)
    return sides[:: view.sign, index].take(held, axis=1), pixels


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


def _end_reasons(strips: Profiles, index: int, run: tuple[int, int], line: LineFit, fits: Fits) -> tuple[str, str]:
    """Why the segment ends at either end."""
    view = strips.views[index]
    profiles, margin = strips.u.shape[1], strips.side + 2
    reasons = []
    cuts = view.columns[0] > 0.0, view.columns[1] < view.view.width - 1.0
    for neighbour, cut in zip((run[0] - 1, run[1] + 1), cuts, strict=True):
        if not 0 <= neighbour < profiles:
            reasons.append("span" if cut else "picture")
            continue
        beyond = line.level + line.slope * (float(strips.u[index, neighbour]) - line.center)
        outside = not margin <= beyond <= view.view.height - 1.0 - margin
        reasons.append("picture" if outside else ("end" if fits.visible[index, neighbour] else "mask"))
    return reasons[0], reasons[1]
