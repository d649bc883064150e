"""What the two sides of an edge must look like: by colour, and for the border of the surface by depth as well."""

from __future__ import annotations

import itertools

import numpy as np

from ibvs_qp.vision.appearance.colors import BOARD, PAINT, SurfaceColors

#: What lines demand of their sides: nothing, paint beside board, border of the surface; times the surface's side.
_ANY, _PAINT_EDGE, _BORDER = 0, 1, 2


def _fits(kind: int, surface_behind: bool, labels: tuple[int, int], off: tuple[bool, bool]) -> bool:
    """Whether labels and depth before and behind an edge are those that a line demands."""
    near, far = (1, 0) if surface_behind else (0, 1)
    surface, other = labels[near], labels[far]
    if kind == _PAINT_EDGE:
        return surface == BOARD and other == PAINT
    if kind == _BORDER:
        # a wall may have the board's colour or the paint's, but not their depth; lines on the board have both
        return surface != 0 and not off[near] and (other == 0 or off[far])
    return True


#: All answers of `_fits`, uint8, read at kind, side, off behind, off before, label behind, label before, in this order.
FITS = np.array(
    [
        _fits(kind, side, (before, behind), (off_before, off_behind))
        for kind, side, off_behind, off_before, behind, before in itertools.product(
            range(3), (False, True), (False, True), (False, True), range(3), range(3)
        )
    ],
    np.uint8,
)


def kind_of(kind: str, side: int, colors: SurfaceColors) -> int:
    """What a line of some kind demands of its sides: nothing, a paint edge, or the surface's border."""
    if not kind or side == 0 or colors.board is None:
        return _ANY
    if kind == "paint":
        return _PAINT_EDGE if colors.paint_distinct else _ANY
    return _BORDER
