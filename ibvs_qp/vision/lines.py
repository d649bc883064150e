"""Sub-pixel fits of lines around their predictions, all in one batch, with covariance and visible segment."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.profiles import Strips
from ibvs_qp.vision.query import LineQuery, LineView
from ibvs_qp.vision.refined import Fits, RefinedLine, finish_line
from ibvs_qp.vision.robust import consensus_lines, longest_runs, masked_median, packed, robust_lines

#: A profile's gradient must reach this share of the line's whole step (a sharp edge reaches 0.4).
_STEP_SHARE = 0.12
#: The same of the smallest allowed contrast, for faint lines.
_FAINT_SHARE = 0.3
#: Colour steps smaller than this have no direction [grey levels].
_STEP_MIN = 1e-3
#: Turns a gradient's peak into the size of the step: a blur of 0.7 px leaves 0.4 of it.
_PEAK_TO_STEP = 2.5
#: Profiles that tell the colour step of a new line: gradients above this share of the median one.
_TELLING = 0.5


def refine_lines(
    picture: Picture,
    queries: list[LineQuery],
    *,
    half_width_px: float,
    config: LineConfig,
    colors: SurfaceColors,
    contents: bool = False,
) -> list[RefinedLine | None]:
    """Fit the lines near their predictions.

    Args:
        picture: Colour, mask and depth.
        queries: Predicted lines.
        half_width_px: Half width of the search strips [px].
        config: Settings.
        colors: What board and paint look like.
        contents: Whether the results shall carry the colours of their sides and the places of their profiles.

    Returns:
        For every query its line, or None when nothing there supports it.
    """
    found: list[RefinedLine | None] = [None] * len(queries)
    views = [LineView.of(picture, query) for query in queries]
    used = [k for k, view in enumerate(views) if view.last - view.first >= config.profiles // 8]
    if not used:
        return found
    strips = Strips.gather(picture, [views[k] for k in used], config, max(2, round(half_width_px)))
    fits = _fit(strips, strips.admissible(colors), config, picture.scale)
    sides = strips.sides(fits.lines.rows(strips.u)) if contents else None
    for index, k in enumerate(used):
        if fits.alive[index]:
            found[k] = finish_line(index, fits, strips, sides, config)
    return found


def _fit(strips: Strips, admissible: np.ndarray, config: LineConfig, scale: float) -> Fits:
    directions = _directions(strips, admissible)
    norm = np.sqrt(np.vecdot(directions, directions))
    response = strips.response((directions / np.maximum(norm, _STEP_MIN)[:, None]).astype(np.float32)) * admissible
    faint = _FAINT_SHARE * config.contrast_min
    threshold = np.maximum(_STEP_SHARE * norm, faint)
    board = np.array([view.query.kind == "board" for view in strips.views])
    if strips.off is not None and board.any():
        # the border of the surface is known by its two sides: beyond it the wall may change from brick to joint, and
        # where the known step fails any step counts
        failing = (response.max(axis=2) < threshold[:, None]) & board[:, None]
        if failing.any():
            response[failing] = strips.strength(failing) * admissible[failing]
            threshold[failing.any(axis=1)] = faint
    rows, good = strips.peaks(response, threshold)
    u, gate = strips.u.astype(float), config.inlier_px * scale
    count, (u_good, rows_good) = packed(good, u, rows)
    level, slope, alive = consensus_lines(u_good, rows_good, count, gate)
    alive &= (norm >= _STEP_MIN) & (count >= config.min_profiles)
    support = good & (np.abs(rows - level[:, None] - slope[:, None] * u) < gate) & alive[:, None]
    visible = strips.visible
    runs = longest_runs(support, visible, config.bridge)
    profile, limits = np.arange(support.shape[1]), np.array(runs)[:, :, None]
    support &= (profile >= limits[:, 0]) & (profile <= limits[:, 1])
    count, (u_in, rows_in) = packed(support, u, rows)
    lines = robust_lines(u_in, rows_in, count)
    before, behind = strips.sides(rows)
    change = (behind.astype(np.float32) - before).transpose(0, 2, 1)
    steps = masked_median(change, support)
    alive &= (count >= config.min_profiles) & (np.vecdot(steps, steps) >= config.contrast_min**2)
    return Fits(lines, support, visible, runs, steps, alive)


def _directions(strips: Strips, admissible: np.ndarray) -> np.ndarray:
    """Mix of channels that shows each line: its known step along +v of the view, else what the strip shows, (L, 3)."""
    known = [None if view.query.step is None else view.sign * view.query.step for view in strips.views]
    fresh = [k for k, step in enumerate(known) if step is None]
    directions = np.array([np.zeros(3) if step is None else step for step in known])
    if not fresh:
        return directions
    gradient = strips.gradient(np.array(fresh))
    polarity = np.array([strips.views[k].sign * strips.views[k].query.polarity for k in fresh], np.float32)
    oriented = gradient * np.where(polarity == 0.0, np.float32(1.0), polarity)[:, None, None, None]
    oriented[polarity == 0.0] = np.abs(oriented[polarity == 0.0])
    strength = np.maximum(np.maximum(oriented[..., 0], oriented[..., 1]), oriented[..., 2]) * admissible[fresh]
    lines, profiles, size = strength.shape
    place = np.argmax(strength, axis=2) + size * np.arange(lines * profiles).reshape(lines, profiles)
    weight = strength.take(place)
    telling = weight > _TELLING * np.sort(weight, axis=1)[:, profiles // 2, None]
    strongest = gradient.reshape(-1, 3).take(place, axis=0).transpose(0, 2, 1)
    typical = masked_median(strongest, telling)
    directions[fresh] = np.where(telling.any(axis=1)[:, None], _PEAK_TO_STEP * typical, 0.0)
    return directions
