"""How bright the paint is in this light: its colour is known to the strategy, the camera's exposure is not."""

from __future__ import annotations

import ctypes
import math

import numpy as np

from ibvs_qp.vision.native_colors import Gates, paint_natively

#: Light in which paint is looked for, times the light in which its colour was named.
_DIMMEST, _BRIGHTEST = 0.4, 2.5
#: Distance from the paint's tint, share of the gate in that light: a cut-off channel or a mixed edge is farther.
_TINT = 0.6
#: Fewer samples beside the brush tell nothing.
_LEAST = 12
#: Light nearer to the named one than this needs no correction [ln]: the gate holds it.
_AS_NAMED = 0.08


def paint_as_lit(colors: np.ndarray, paint: np.ndarray, board: np.ndarray, gate: float) -> np.ndarray | None:
    """The paint's colour in the light of the reference, by samples of its tint.

    Args:
        colors: Samples beside the brush in the light of the reference, RGB (n, 3).
        paint: The paint's colour as it was named, RGB (3,).
        board: The board's colour in the light of the reference, RGB (3,).
        gate: Distance within which a colour matches [grey levels].

    Returns:
        RGB (3,), ``paint`` itself where the light is as when it was named; None where no paint is seen.
    """
    light = colors @ (paint / max(float(paint @ paint), 1.0))
    off, apart = colors - light[:, None] * paint, colors - board
    painted = (light > _DIMMEST) & (light < _BRIGHTEST) & (np.vecdot(off, off) < (_TINT * gate * light) ** 2)
    painted &= np.vecdot(apart, apart) > gate**2
    count = int(np.count_nonzero(painted))
    return _as_lit(paint, count, float(np.median(light[painted])) if count else 1.0)


def paint_seen_natively(
    library: ctypes.CDLL, colors: np.ndarray, places: np.ndarray, paint: np.ndarray, board: np.ndarray, gate: float
) -> np.ndarray | None:
    """The same by machine code in even light, of samples at flat places (n,) of colours uint8 (rows, columns, 3)."""
    gates = Gates(gate**2, 0.0, _TINT * gate, _DIMMEST, _BRIGHTEST, 0.0, 0.0)
    return _as_lit(paint, *paint_natively(library, colors, places, paint, board, gates))


def _as_lit(paint: np.ndarray, count: int, found: float) -> np.ndarray | None:
    """The paint in the light that was found among so many samples."""
    if count < _LEAST:
        return None
    return paint if abs(math.log(found)) < _AS_NAMED else np.float32(found) * paint
