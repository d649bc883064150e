"""Sub-pixel fits of lines around their predictions, all in one batch, with covariance and visible segment."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.admissible import Admissible
from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.consensus import consensus_lines, shifted_lines
from ibvs_qp.vision.fit_lines import fitted_rows, longest_runs, robust_lines
from ibvs_qp.vision.native import native
from ibvs_qp.vision.native_lines import Fitted, fit_natively
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.profiles import Strips
from ibvs_qp.vision.query import LineQuery, LineView
from ibvs_qp.vision.refined import Fits, Profiles, RefinedLine, finish_lines
from ibvs_qp.vision.robust import masked_median

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
#: Places from which pairs of points are tried.
_STARTS = 20
#: Share of the visible profiles, where the line was seen last, below which first sight is not enough.
_ENOUGH = 0.5


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
    wanted, reach, library = [views[k] for k in used], max(2, round(half_width_px)), native()
    fitted = None
    if library is not None:
        fitted = fit_natively(library, picture, wanted, reach, config, colors, contents)
    if fitted is None:
        fitted = fit_with_numpy(picture, wanted, reach, config, colors, contents)
    for k, line in zip(used, finish_lines(*fitted, config), strict=True):
        found[k] = line
    return found


def fit_with_numpy(
    picture: Picture, views: list[LineView], reach: int, config: LineConfig, colors: SurfaceColors, contents: bool
) -> Fitted:
    """Fit lines where there is no machine code, and to say what it computes; arguments as for `fit_natively`."""
    strips = Strips.gather(picture, views, config, reach)
    fits = _fit(strips, Admissible(strips, colors), config, picture.scale)
    sides = np.array(strips.sides(fitted_rows(fits.lines, strips.u))) if contents else None
    return Fitted(fits, Profiles(views, strips.u, strips.side), sides)


def _fit(strips: Strips, admissible: Admissible, config: LineConfig, scale: float) -> Fits:
    known = all(view.query.step is not None for view in strips.views)
    directions = _directions(strips, admissible)
    norm = np.sqrt(np.vecdot(directions, directions))
    units = (directions / np.maximum(norm, _STEP_MIN)[:, None]).astype(np.float32)
    threshold = np.maximum(_STEP_SHARE * norm, _FAINT_SHARE * config.contrast_min)
    rows, good = _edges(strips, admissible, strips.response(units), threshold, _FAINT_SHARE * config.contrast_min)
    gate = config.inlier_px * scale
    distance, alive = shifted_lines(rows - strips.predicted, good, gate)
    if not (known and alive.all()):
        distance, alive = consensus_lines(strips.u, rows, good, gate, _STARTS)
    alive &= (norm >= _STEP_MIN) & (np.count_nonzero(good, axis=1) >= config.min_profiles)
    support = good & (np.abs(distance) < gate) & alive[:, None]
    visible = strips.visible
    runs = longest_runs(support, visible, config.bridge)
    for held, (first, last) in zip(support, runs, strict=True):
        held[:first] = held[last + 1 :] = False
    count = np.count_nonzero(support, axis=1)
    lines = robust_lines(strips.u, rows, support, count)
    before, behind = strips.sides(rows)
    change = np.subtract(behind, before, dtype=np.float32)
    steps = (support.astype(np.float32)[:, None] @ change)[:, 0] / np.maximum(count, 1)[:, None]
    alive &= (count >= config.min_profiles) & (np.vecdot(steps, steps) >= config.contrast_min**2)
    seen = [
        int(np.count_nonzero(one[first : last + 1])) for one, (first, last) in zip(visible | support, runs, strict=True)
    ]
    return Fits(lines, support, visible, count.tolist(), seen, runs, steps.tolist(), alive.tolist())


def _edges(
    strips: Strips, admissible: Admissible, response: np.ndarray, threshold: np.ndarray, faint: float
) -> tuple[np.ndarray, np.ndarray]:
    """Sub-pixel row of every profile's edge, and whether it has one, (L, K) each.

    Looks at the strongest answer of every profile first; only where that may not be an edge of the line are the
    other places judged, which costs many times as much.
    """
    shape, flat = strips.u.shape, response.reshape(-1, response.shape[2])
    index = strips.strongest(flat)
    place, peak, good = strips.peaks(flat, index)
    limit = np.repeat(threshold, shape[1])
    good &= (peak > limit) & admissible.at(index)
    few = good.reshape(shape).sum(axis=1) < _ENOUGH * (strips.visible & strips.expected).sum(axis=1)
    if not few.any():
        return strips.base + place.reshape(shape), good.reshape(shape)
    rest = np.flatnonzero(few.repeat(shape[1]) & ~good)
    shown = flat.take(rest, axis=0)
    strong = shown.max(axis=1) > limit.take(rest) if len(rest) else np.zeros(0, bool)
    border = admissible.board.take(rest) if admissible.depth_known else np.zeros(len(rest), bool)
    rest, shown, strong, border = (part[strong | border] for part in (rest, shown, strong, border))
    if len(rest):
        allowed = admissible.everywhere(rest)
        masked = shown * allowed
        # the border of the surface is known by its two sides: beyond it the wall may change from brick to joint, and
        # where the known step fails any step counts
        failing = np.flatnonzero(border & (masked.max(axis=1) < limit.take(rest)))
        if len(failing):
            gradient = strips.gradient(rest.take(failing))
            shown[failing] = np.sqrt(np.vecdot(gradient, gradient))
            masked[failing] = shown[failing] * allowed[failing]
            lines = np.unique(rest.take(failing) // shape[1])
            limit.reshape(shape)[lines] = faint
        index = strips.strongest(masked)
        place[rest], peak, inner = strips.peaks(shown, index)
        fits = allowed.reshape(-1).take(index + np.arange(0, allowed.size, allowed.shape[1]))
        good[rest] = inner & fits & (peak > limit.take(rest))
    return strips.base + place.reshape(shape), good.reshape(shape)


def _directions(strips: Strips, admissible: Admissible) -> np.ndarray:
    """Mix of channels that shows each line: its known step along +v of the view, else what the strip shows, (L, 3)."""
    steps = [view.query.step for view in strips.views]
    directions = np.array(
        [np.zeros(3) if step is None else view.sign * step for step, view in zip(steps, strips.views, strict=True)]
    )
    fresh = np.array([k for k, step in enumerate(steps) if step is None], np.intp)
    if not len(fresh):
        return directions
    profiles = strips.u.shape[1]
    rows = (fresh[:, None] * profiles + np.arange(profiles)).reshape(-1)
    gradient = strips.gradient(rows)
    polarity = np.array([strips.views[k].sign * strips.views[k].query.polarity for k in fresh], np.float32)
    signs = np.repeat(polarity, profiles)[:, None, None]
    oriented = np.where(signs == 0.0, np.abs(gradient), gradient * signs)
    strength = np.maximum(np.maximum(oriented[..., 0], oriented[..., 1]), oriented[..., 2])
    strength *= admissible.everywhere(rows)
    place = strength.argmax(axis=1) + np.arange(0, strength.size, strength.shape[1])
    weight = np.maximum(strength.take(place), 0.0).reshape(len(fresh), profiles)  # the other polarity tells nothing
    telling = weight > _TELLING * np.sort(weight, axis=1)[:, profiles // 2, None]
    strongest = gradient.reshape(-1, 3).take(place, axis=0).reshape(len(fresh), profiles, 3).transpose(0, 2, 1)
    typical = masked_median(strongest, telling)
    directions[fresh] = np.where(telling.any(axis=1)[:, None], _PEAK_TO_STEP * typical, 0.0)
    return directions
