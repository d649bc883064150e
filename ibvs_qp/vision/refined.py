"""A fitted line: from pixels of a strip to (rho, theta) with covariance, segment and the reasons of its ends."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.frames import align_line
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.picture import Picture, normalise, normalised_line
from ibvs_qp.vision.profiles import Strip


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
        sides: Colours at the agreeing profiles before and behind the line, along the normal, (2, n, 3).
        pixels: Places of the agreeing profiles, (n, 2) [px].
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
class PixelFit:
    """Result of the fit in the (possibly transposed) view: v = level + slope (u - center)."""

    level: float
    slope: float
    center: float
    covariance: np.ndarray
    support: np.ndarray
    visible: np.ndarray
    run: tuple[int, int]
    rms: float
    step: np.ndarray


def finish_line(
    fit: PixelFit,
    strip: Strip,
    view: Picture,
    columns: tuple[float, float],
    upright: bool,
    sign: float,
    theta: float,
    config: LineConfig,
) -> RefinedLine | None:
    """Turn a pixel fit into a normalised line with covariance and segment."""

    def polar(level: float, slope: float) -> tuple[float, float]:
        rho, angle = normalised_line(-slope, 1.0, slope * fit.center - level, view.intrinsics)
        return align_line(rho, 0.5 * math.pi - angle if upright else angle, theta)

    rho, angle = polar(fit.level, fit.slope)
    if abs(rho) > config.rho_max:
        return None
    small = 1e-4
    jacobian = (
        np.array(
            [
                np.subtract(polar(fit.level + small, fit.slope), (rho, angle)),
                np.subtract(polar(fit.level, fit.slope + small), (rho, angle)),
            ]
        ).T
        / small
    )
    covariance = fit.covariance.copy()
    covariance[0, 0] += (config.bias_px * view.scale) ** 2
    ends_u = strip.u[list(fit.run)].astype(float)
    ends = np.column_stack((ends_u, fit.level + fit.slope * (ends_u - fit.center)))
    u = strip.u[fit.support].astype(float)
    pixels = np.column_stack((u, fit.level + fit.slope * (u - fit.center)))
    segment = normalise(ends, view.intrinsics)
    before, behind = strip.sides(fit.level + fit.slope * (strip.u - fit.center))
    sides = np.stack((before[fit.support], behind[fit.support]))
    seen = fit.visible[fit.run[0] : fit.run[1] + 1]
    return RefinedLine(
        rho=rho,
        theta=angle,
        covariance=jacobian @ covariance @ jacobian.T,
        segment=segment[:, ::-1].copy() if upright else segment,
        ends=_end_reasons(fit, strip, columns, (view.height, view.width)),
        inlier_share=float(fit.support.sum())
        / max(int(np.count_nonzero(seen | fit.support[fit.run[0] : fit.run[1] + 1])), 1),
        rms_px=fit.rms,
        length_px=float(np.hypot(*(ends[1] - ends[0]))),
        step=sign * fit.step,
        sides=sides if sign > 0 else sides[::-1],
        pixels=pixels[:, ::-1].copy() if upright else pixels,
    )


def _end_reasons(fit: PixelFit, strip: Strip, columns: tuple[float, float], shape: tuple[int, ...]) -> tuple[str, str]:
    """Why the segment ends at either end."""
    width = shape[1]
    last = len(strip.u) - 1
    reasons = []
    for neighbour, cut in ((fit.run[0] - 1, columns[0] > 0.0), (fit.run[1] + 1, columns[1] < width - 1.0)):
        if neighbour < 0 or neighbour > last:
            reasons.append("span" if cut else "picture")
            continue
        beyond = fit.level + fit.slope * (strip.u[neighbour] - fit.center)
        margin = strip.side + 2
        outside = not margin <= beyond <= shape[0] - 1.0 - margin
        reasons.append("picture" if outside else ("end" if fit.visible[neighbour] else "mask"))
    return reasons[0], reasons[1]
