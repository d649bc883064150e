"""Camera pictures of a flight as JPEG: raw ones would fill a gigabyte."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np

from sim.flight.trace import Trace

JPEG_QUALITY = 88


def pack_picture(rgb: np.ndarray) -> np.ndarray:
    """JPEG bytes of an RGB picture, (K,) uint8."""
    good, data = cv2.imencode(".jpg", rgb[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
    if not good:
        raise ValueError(f"a picture of shape {rgb.shape} cannot be encoded")
    return data.ravel()


def unpack_picture(picture: np.ndarray) -> np.ndarray:
    """RGB picture, (H, W, 3), of a raw picture or of `pack_picture`'s bytes."""
    if picture.ndim == 3:
        return picture
    decoded = cv2.imdecode(picture, cv2.IMREAD_COLOR)
    if decoded is None:
        raise ValueError("a packed picture of the trace is damaged")
    return np.ascontiguousarray(decoded[..., ::-1])


def pack_pictures(trace: Trace) -> Trace:
    """The trace with every raw picture packed."""
    packed = [(t, pack_picture(p) if p.ndim == 3 else p, phase) for t, p, phase in trace.pictures]
    return dataclasses.replace(trace, pictures=packed)
