"""Sub-pixel fit of one line around a prediction, with covariance and visible segment."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.picture import Picture, pixel_line
from ibvs_qp.vision.profiles import Expected, Strip
from ibvs_qp.vision.refined import PixelFit, RefinedLine, finish_line
from ibvs_qp.vision.robust import column_median, consensus_line, longest_run, median, robust_line

#: A profile's gradient must reach this share of the line's whole step (a sharp edge reaches 0.4).
_STEP_SHARE = 0.12
#: The same of the smallest allowed contrast, for faint lines.
_FAINT_SHARE = 0.3
#: Colour steps smaller than this have no direction [grey levels].
_STEP_MIN = 1e-3


def refine_line(
    picture: Picture,
    rho: float,
    theta: float,
    *,
    half_width_px: float,
    config: LineConfig,
    colors: SurfaceColors,
    step: np.ndarray | None = None,
    polarity: int = 0,
    span: tuple[float, float] | None = None,
    kind: str = "",
    surface_side: int = 0,
) -> RefinedLine | None:
    """Fit the line near a prediction.

    Args:
        picture: Colour and mask.
        rho: Predicted distance, normalised.
        theta: Predicted angle [rad].
        half_width_px: Half width of the search strip [px].
        config: Settings.
        colors: What board and paint look like.
        step: Colour step across the line, along the normal, (3,); None for a new line.
        polarity: +1 or -1 if a new line's colours rise or fall along the normal, 0 if unknown.
        span: Normalised range along x (level lines) or y (upright ones) to look at, or None for the whole picture.
        kind: "board", "paint" or "": what the two sides must look like.
        surface_side: Side of the working surface along the normal.

    Returns:
        The line, or None when nothing there supports it.
    """
    upright = abs(math.cos(theta)) > abs(math.sin(theta))
    view = picture.transposed if upright else picture
    angle = 0.5 * math.pi - theta if upright else theta
    sign = 1.0 if math.sin(angle) > 0.0 else -1.0  # the fit runs along +v, the normal may point along -v
    p, q, r = pixel_line(rho, angle, view.intrinsics)
    width = view.width
    columns = (0.0, width - 1.0)
    if span is not None:
        fx, _, cx, _ = view.intrinsics
        columns = (fx * span[0] + cx, fx * span[1] + cx)
    strip = Strip.gather(view, (p, q, r), columns, config.profiles, max(2, round(half_width_px)))
    if strip is None:
        return None
    admissible = strip.admissible(Expected(kind=kind, side=int(sign) * surface_side), colors)
    direction = None if step is None else sign * np.asarray(step, np.float32)
    fit = _fit(strip, admissible, direction, int(sign) * polarity, config, view.scale, kind)
    if fit is None:
        return None
    return finish_line(fit, strip, view, columns, upright, sign, theta, config)


def _fit(
    strip: Strip,
    admissible: np.ndarray,
    direction: np.ndarray | None,
    polarity: int,
    config: LineConfig,
    scale: float,
    kind: str,
) -> PixelFit | None:
    if direction is None:
        direction = _best_direction(strip.gradient(), admissible, polarity)
    norm = float(np.linalg.norm(direction))
    if norm < _STEP_MIN:
        return None
    response = strip.response((direction / norm).astype(np.float32)) * admissible
    threshold = max(_STEP_SHARE * norm, _FAINT_SHARE * config.contrast_min)
    if strip.off is not None and kind == "board":
        # the border of the surface is known by its two sides: beyond it the wall may change from brick to joint, and
        # where the known step fails any step counts
        failing = response.max(axis=1) < threshold
        if failing.any():
            response[failing] = (strip.strength() * admissible)[failing]
            threshold = _FAINT_SHARE * config.contrast_min
    rows, good = strip.peaks(response, threshold)
    if int(good.sum()) < config.min_profiles:
        return None
    u = strip.u.astype(float)
    gate = config.inlier_px * scale
    start = consensus_line(u[good], rows[good], gate)
    if start is None:
        return None
    support = good & (np.abs(rows - start[0] - start[1] * u) < gate)
    visible = strip.visible
    run = longest_run(support, visible, config.bridge)
    inside = np.zeros_like(support)
    inside[run[0] : run[1] + 1] = True
    support &= inside
    if int(support.sum()) < config.min_profiles:
        return None
    result = robust_line(u[support], rows[support])
    before, behind = strip.sides(rows)
    step = column_median(behind[support].astype(np.float32) - before[support])
    if float(np.linalg.norm(step)) < config.contrast_min:
        return None
    return PixelFit(*result[:4], support, visible, run, result[4], step)


def _best_direction(gradient: np.ndarray, admissible: np.ndarray, polarity: int) -> np.ndarray:
    """Mix of channels that shows a new line: mean gradient at the strongest place of every profile."""
    rising = gradient.max(axis=2)
    falling = -gradient.min(axis=2)
    strength = {1: rising, -1: falling}.get(polarity, np.maximum(rising, falling)) * admissible
    index = np.argmax(strength, axis=1)
    found = gradient[np.arange(len(index)), index]
    weight = strength[np.arange(len(index)), index]
    used = weight > 0.5 * median(weight)
    # 2.5 turns a gradient's peak into the size of the step: a blur of 0.7 px leaves 0.4 of it
    return 2.5 * column_median(found[used]) if used.any() else np.zeros(3, np.float32)
