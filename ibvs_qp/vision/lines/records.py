"""Records of the kernels of the line fit: predicted lines, the same in their views, fitted lines, and pixels."""

from __future__ import annotations

from typing import NamedTuple

import numba as nb
import numpy as np

#: Demands of a line on its two sides: none, paint beside board, border of the surface.
ANY, PAINT_EDGE, BORDER = range(3)
#: Why a segment ends: the picture does, the vehicle hides the rest, no more was looked at, or the line really ends.
ENDS = ("picture", "mask", "span", "end")
BY_PICTURE, BY_MASK, BY_SPAN, BY_END = range(4)

#: A predicted line.
QUERY = np.dtype(
    [
        ("rho", "f8"),  # normalised
        ("theta", "f8"),  # [rad]
        ("span", "f8", 2),  # range along x (level lines) or y (upright ones) to look at, normalised
        ("seen", "f8", 2),  # range in which it was seen last
        ("known", "?"),  # whether its colour step is known
        ("step", "f8", 3),  # this step along the normal
        ("polarity", "i8"),  # of a new line along the normal, 0 if unknown
        ("demand", "i8"),  # on its sides
        ("surface_side", "i8"),  # along the normal
        ("border", "?"),  # whether it is the border of the surface
    ],
    align=True,
)
#: The same line v = slope u + level [px] in the view in which it is level: an upright one has rows and columns swapped.
VIEW = np.dtype(
    [
        ("upright", "?"),
        ("row_step", "i8"),  # flat distances of the view's pixels
        ("column_step", "i8"),
        ("height", "i8"),  # [px]
        ("fx", "f8"),
        ("fy", "f8"),
        ("cx", "f8"),
        ("cy", "f8"),
        ("slope", "f8"),
        ("level", "f8"),
        ("first", "f8"),  # columns to look at
        ("last", "f8"),
        ("cut_first", "?"),  # whether the picture goes on before them
        ("cut_last", "?"),  # whether it does behind them
        ("seen", "f8", 2),  # columns in which it was seen last
        ("sign", "f8"),  # +1 if its normal points along +v, else -1
        ("surface_behind", "?"),
        ("step", "f8", 3),  # along +v
        ("polarity", "f8"),  # along +v
        ("plane", "f8", 3),  # 1/Z = p u + q v + r of the surface
    ],
    align=True,
)
#: A fitted line.
LINE = np.dtype(
    [
        ("alive", "?"),  # whether there is one: nothing else is valid otherwise
        ("rho", "f8"),
        ("theta", "f8"),
        ("covariance", "f8", (2, 2)),  # of (rho, theta)
        ("segment", "f8", (2, 2)),  # its ends, normalised
        ("ends", "i8", 2),  # why it ends there, as places in `ENDS`
        ("inlier_share", "f8"),  # fraction of the run's profiles that agree
        ("count", "i8"),  # how many agree
        ("rms_px", "f8"),
        ("length_px", "f8"),
        ("step", "f8", 3),  # colour step along the normal
    ],
    align=True,
)


class Pixels(NamedTuple):
    """The picture for the line fit."""

    rgb: np.ndarray  # colour, uint8 (H, W, 3)
    mask: np.ndarray  # non-zero where the vehicle hides the view, uint8 (H, W)
    depth: np.ndarray  # depth [m], float32 (H W,); empty if it or the surface is unknown
    table: np.ndarray  # labels of all colours in every level of light, uint8; may be empty if no line demands any
    levels: np.ndarray  # level of light in cells of the picture, uint8; empty where it is even
    camera: tuple[float, float, float, float]  # (fx, fy, cx, cy) [px]
    plane: tuple[float, float, float]  # (a, b, c) of the surface, zero if unknown


class Search(NamedTuple):
    """How lines are searched and fitted."""

    reach: int  # rows searched on either side of a prediction
    side: int  # distance from an edge at which its two sides are looked at [px]
    contrast_min: float  # least colour step of a line [grey levels]
    gate: float  # distance within which a profile agrees with a line [px]
    bridge: float  # longest gap of visible misses that does not end a line [px]
    profiles: int  # most profiles of a line
    min_profiles: int  # least profiles that must agree
    bias: float  # standard deviation of a line that no number of profiles makes less [px]


class Strip(NamedTuple):
    """K profiles of M = 2 (reach + side) + 1 pixels across a line, around the predicted rows of its view."""

    colors: np.ndarray  # RGB of the pixels, uint8 (K, 3 M)
    hidden: np.ndarray  # non-zero where a pixel is hidden or outside the picture, uint8 (K, M)
    visible: np.ndarray  # whether the middle of a profile is neither, uint8 (K,)
    good: np.ndarray  # whether a profile supports the line, uint8 (K,)
    u: np.ndarray  # columns of the profiles [px], growing, (K,)
    predicted: np.ndarray  # predicted rows [px], (K,)
    base: np.ndarray  # the same in whole pixels, (K,)
    row: np.ndarray  # rows of the edges [px], (K,)
    distance: np.ndarray  # of the edges from their consensus [px], (K,)


_U1, _F8, _I8 = nb.u1, nb.f8, nb.i8
#: Types of these for the signature of a kernel.
QUERIES, LINES = (nb.from_dtype(record)[::1] for record in (QUERY, LINE))
PIXELS = nb.types.NamedTuple(
    (
        _U1[:, :, ::1], _U1[:, ::1], nb.f4[::1], _U1[::1], _U1[::1], nb.types.UniTuple(_F8, 4),
        nb.types.UniTuple(_F8, 3),
    ),
    Pixels,
)  # fmt: skip
SEARCH = nb.types.NamedTuple((_I8, _I8, _F8, _F8, _F8, _I8, _I8, _F8), Search)
