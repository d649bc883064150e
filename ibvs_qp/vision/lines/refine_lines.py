"""Sub-pixel fits of lines around their predictions, all in one batch, with covariance and visible segment."""

from __future__ import annotations

from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.lines.fit_lines import fit_lines
from ibvs_qp.vision.lines.query import LineQuery, LineView
from ibvs_qp.vision.lines.refined import RefinedLine, finish_lines
from ibvs_qp.vision.picture.picture import Picture


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
    fitted = fit_lines(picture, [views[k] for k in used], max(2, round(half_width_px)), config, colors, contents)
    for k, line in zip(used, finish_lines(*fitted, config), strict=True):
        found[k] = line
    return found
