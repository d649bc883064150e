"""Fits of predicted lines by the kernel: what it needs of them, and what it found."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.kernels import line_tables as t
from ibvs_qp.vision.kernels.fit_lines import fit_lines as fit_in_strips
from ibvs_qp.vision.lines.admissible import FITS, kind_of
from ibvs_qp.vision.lines.fits import Fits, Fitted, LineFit, Profiles
from ibvs_qp.vision.lines.query import LineView
from ibvs_qp.vision.picture.picture import Picture

#: Distance from the edge at which its two sides are looked at [px at 640]: beyond blur, within a 10 mm margin.
_SIDE_PX = 4.0
_NO_STEP = (0.0, 0.0, 0.0)
_NO_DEPTH, _NO_LABELS, _NO_SIDES = np.empty(0, np.float32), np.empty(0, np.uint8), np.empty((2, 0, 0, 3), np.uint8)


def fit_lines(
    picture: Picture, views: list[LineView], reach: int, config: LineConfig, colors: SurfaceColors, contents: bool
) -> Fitted:
    """Fit lines around their predictions, all in one call.

    Args:
        picture: Colour, mask and depth.
        views: The lines, (L).
        reach: Half width of the search strips [px].
        config: Settings.
        colors: What board and paint look like.
        contents: Whether the colours of both sides are wanted.
    """
    count, profiles, side = len(views), _profile_count(views, config), max(2, round(_SIDE_PX * picture.scale))
    depth = _NO_DEPTH
    if picture.depth is not None and picture.plane is not None:
        depth = picture.depth.astype(np.float32, copy=False)
    queries = np.array([_query(view, colors) for view in views])
    found, u = np.empty((count, t.FIT_COLUMNS)), np.empty((count, profiles))
    support, visible = np.empty((count, profiles), np.uint8), np.empty((count, profiles), np.uint8)
    sides = np.empty((2, count, profiles, 3), np.uint8) if contents else _NO_SIDES
    fit_in_strips(
        picture.rgb,
        picture.mask,
        depth,
        _NO_LABELS if colors.board is None else colors.table(),
        _NO_LABELS if colors.levels is None else colors.levels.reshape(-1),
        FITS,
        queries,
        reach,
        side,
        config.contrast_min,
        config.inlier_px * picture.scale,
        config.bridge_px * picture.scale,
        config.min_profiles,
        found,
        u,
        support,
        visible,
        sides,
    )
    rows = found.tolist()
    fits = Fits(
        lines=[LineFit(*row[: t.FIT_RMS + 1]) for row in rows],
        support=support.view(bool),
        visible=visible.view(bool),
        count=[int(row[t.FIT_COUNT]) for row in rows],
        seen=[int(row[t.FIT_SEEN]) for row in rows],
        runs=[(int(row[t.FIT_FIRST]), int(row[t.FIT_LAST])) for row in rows],
        steps=[row[t.FIT_RED : t.FIT_BLUE + 1] for row in rows],
        alive=[row[t.FIT_ALIVE] != 0.0 for row in rows],
    )
    return Fitted(fits, Profiles(views, u, side), sides if contents else None)


def _profile_count(views: list[LineView], config: LineConfig) -> int:
    """Profiles along each of the lines: no column twice."""
    return min(config.profiles, int(min(view.last - view.first for view in views)) + 1)


def _query(view: LineView, colors: SurfaceColors) -> tuple[float, ...]:
    """What the kernel needs of one line, in the order of `line_tables`."""
    query, picture = view.query, view.view
    step = _NO_STEP if query.step is None else (view.sign * query.step).tolist()
    return (
        view.first + 0.5,
        view.last - view.first,
        *view.slope_level,
        picture.height,
        picture.row_step,
        picture.column_step,
        *view.extent,
        query.step is not None,
        *step,
        view.sign * query.polarity,
        kind_of(query.kind, view.side, colors),
        view.side > 0,
        query.kind == "board",
        *view.surface,
    )
