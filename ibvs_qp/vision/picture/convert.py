"""Raw pictures of any common type as the types of perception; what is of none is left to its checks."""

from __future__ import annotations

import numpy as np


def to_color(picture: np.ndarray, bits: int = 16) -> np.ndarray:
    """Colour of 8 bits, (H, W, 3), from a colour or mono picture.

    Args:
        picture: uint8 or uint16, (H, W), (H, W, 1) or (H, W, 3).
        bits: Bits in use of a uint16.
    """
    if type(picture) is not np.ndarray or picture.ndim not in (2, 3):
        return picture
    if picture.dtype.kind == "u" and picture.dtype.itemsize == 2:
        picture = np.minimum(picture >> (bits - 8), 255).astype(np.uint8)
    if picture.ndim == 2 or picture.shape[2] == 1:
        height, width = picture.shape[:2]
        picture = np.repeat(picture.reshape(height, width, 1), 3, axis=2)
    return picture


def to_metres(picture: np.ndarray, units_per_metre: float) -> np.ndarray:
    """Depth [m], float32 where the unit had to be changed.

    Args:
        picture: Integers or floating point, (H, W); integers without a stated unit stay as they are.
        units_per_metre: Values per metre, 1 for none stated.
    """
    if type(picture) is not np.ndarray or picture.dtype.kind not in "uif" or units_per_metre == 1.0:
        return picture
    return picture.astype(np.float32) * np.float32(1.0 / units_per_metre)
