"""Sub-pixel fits of lines around their predictions, all in one batch, with covariance and visible segment."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.kernels import line_tables as t
from ibvs_qp.vision.kernels.fit_lines import fit_lines
from ibvs_qp.vision.lines.admissible import FITS
from ibvs_qp.vision.lines.query import LineQuery
from ibvs_qp.vision.lines.refined import RefinedLine
from ibvs_qp.vision.picture.picture import Picture

#: Distance from the edge at which its two sides are looked at [px at 640]: beyond blur, within a 10 mm margin.
_SIDE_PX = 4.0
_NO_LABELS, _NO_DEPTH = np.empty(0, np.uint8), np.empty(0, np.float32)


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
    if not queries:
        return []
    lines, kept = np.empty((len(queries), t.LINE_COLUMNS)), len(queries) if contents else 0
    sides, pixels = np.empty((kept, 2, config.profiles, 3), np.uint8), np.empty((kept, config.profiles, 2))
    plane = (0.0, 0.0, 0.0) if picture.plane is None else picture.plane
    fit_lines(
        picture.rgb,
        picture.mask,
        _NO_DEPTH if picture.depth is None or picture.plane is None else picture.depth,
        _NO_LABELS if colors.board is None else colors.table(),
        colors.levels,
        FITS,
        np.array((*picture.intrinsics, *plane)),
        np.array([query.row(colors) for query in queries], float),
        max(2, round(half_width_px)),
        max(2, round(_SIDE_PX * picture.scale)),
        float(config.contrast_min),
        config.inlier_px * picture.scale,
        config.bridge_px * picture.scale,
        config.profiles,
        config.min_profiles,
        config.bias_px * picture.scale,
        lines,
        sides,
        pixels,
    )
    return [
        None
        if row[t.ALIVE] == 0.0 or abs(row[t.LINE_RHO]) > config.rho_max
        else RefinedLine.of(row, sides[k] if contents else None, pixels[k] if contents else None)
        for k, row in enumerate(lines)
    ]
