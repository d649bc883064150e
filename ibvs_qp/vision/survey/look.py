"""The surface as the picture shows it: which samples are its own, and which colour it has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.surface import PlaneEstimate

#: A colour is the surface's if it is its colour in a light this much weaker or stronger ...
_DIMMER, _BRIGHTER = 0.68, 1.4
#: ... up to this share of the colour's size and this distance [grey levels].
_CHROMA, _GREY = 0.10, 14.0


@dataclass(frozen=True, kw_only=True)
class SurfaceLook:
    """The surface in one picture.

    Attributes:
        grid: Coarse grid of the picture.
        plane: Its plane.
        cells: Samples on it by depth, bool (rows, columns).
        colored: Those of them that have its colour, bool (rows, columns).
        color: Its colour where nothing is printed or painted on it, RGB (3,).
        by_light: Whether light tells it from a wall that depth cannot tell it from; `cells` are without the wall then.
    """

    grid: CoarseGrid
    plane: PlaneEstimate
    cells: np.ndarray
    colored: np.ndarray
    color: np.ndarray
    by_light: bool = False


def alike_colors(colors: np.ndarray, color: np.ndarray) -> np.ndarray:
    """Whether colours (..., 3) are one colour (3,) in some light, bool (...)."""
    size = float(np.linalg.norm(color))
    colors = colors.astype(np.float32)
    light = colors @ (color / max(size, 1.0) ** 2).astype(np.float32)
    square = np.vecdot(colors, colors)
    # |c - light color|^2 = |c|^2 - light^2 |color|^2;  |c - color|^2 = that + (light - 1)^2 |color|^2
    offset = np.maximum(square - (light * size) ** 2, 0.0)
    shaded = (light > _DIMMER) & (light < _BRIGHTER) & (offset < (_CHROMA * size + _GREY) ** 2)
    return shaded | (offset + ((light - 1.0) * size) ** 2 < _GREY**2)
