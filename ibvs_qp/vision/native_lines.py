"""Fits of predicted lines by machine code: fills in the tables of native/native.h and reads them."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import numpy as np

from ibvs_qp.vision.admissible import FITS, kind_of
from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.fit_lines import LineFit
from ibvs_qp.vision.native import place
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.profiles import profile_count, side_px
from ibvs_qp.vision.query import LineView
from ibvs_qp.vision.refined import Fits, Profiles

#: Numbers in a `Fit` of native.h, and in its `LineFit`.
_FIT, _LINE = 14, 6
_FITS = FITS.astype(np.uint8)
_NONE = (0.0, 0.0, 0.0)


class Fitted(NamedTuple):
    """Results of one call.

    Attributes:
        fits: The lines.
        profiles: Where their profiles lie.
        sides: Colours before and behind every line at its profiles, uint8 (2, L, K, 3), or None.
    """

    fits: Fits
    profiles: Profiles
    sides: np.ndarray | None


def fit_natively(
    library: ctypes.CDLL,
    picture: Picture,
    views: list[LineView],
    reach: int,
    config: LineConfig,
    colors: SurfaceColors,
    contents: bool,
) -> Fitted | None:
    """What `ibvs_qp.vision.lines` computes with numpy, to rounding; None when memory ran out.

    Args:
        library: The machine code.
        picture: Colour, mask and depth.
        views: The lines, (L).
        reach: Half width of the search strips [px].
        config: Settings.
        colors: What board and paint look like.
        contents: Whether the colours of both sides are wanted.
    """
    count, profiles, side = len(views), profile_count(views, config), side_px(picture)
    depth = picture.depth if picture.plane is not None else None
    if depth is not None and depth.dtype != np.float32:
        depth = depth.astype(np.float32)
    queries = np.array([_query(view, colors) for view in views])
    settings = np.array(
        (
            count,
            profiles,
            reach,
            side,
            config.contrast_min,
            config.inlier_px * picture.scale,
            config.bridge,
            config.min_profiles,
            depth is not None,
        ),
        float,
    )
    labels = None if colors.board is None else colors.table()
    parts = (picture.rgb, picture.mask, depth, labels, colors.levels, _FITS)
    scene = (ctypes.c_void_p * len(parts))(*(place(part) for part in parts))
    found, u = np.empty((count, _FIT)), np.empty((count, profiles))
    support, visible = np.empty((2, count, profiles), np.uint8)
    sides = np.empty((2, count, profiles, 3), np.uint8) if contents else None
    arrays = (settings, queries, found, u, support, visible, sides)
    if not library.fit_lines(scene, *(place(part) for part in arrays)):
        return None
    rows = found.tolist()
    fits = Fits(
        lines=[LineFit(*row[:_LINE]) for row in rows],
        support=support.view(bool),
        visible=visible.view(bool),
        count=[int(row[6]) for row in rows],
        seen=[int(row[7]) for row in rows],
        runs=[(int(row[8]), int(row[9])) for row in rows],
        steps=[row[10:13] for row in rows],
        alive=[row[13] != 0.0 for row in rows],
    )
    return Fitted(fits, Profiles(views, u, side), sides)


def _query(view: LineView, colors: SurfaceColors) -> tuple[float, ...]:
    """One `Query` of native.h."""
    query, picture = view.query, view.view
    step = _NONE if query.step is None else (view.sign * query.step).tolist()
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
