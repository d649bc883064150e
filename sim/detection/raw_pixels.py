"""Detections in rectified pictures, with their pixels in the pictures as taken."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.picture.camera import Lens
from ibvs_qp.vision.picture.picture import denormalise, normalise

#: Farthest a point may lie from the corner, in widths of the picture: far outside a lens model is undefined.
_FARTHEST = 2.0


def ideal_pixel(
    pixel: tuple[float, float] | None, lens: Lens, intrinsics: tuple[float, float, float, float]
) -> tuple[float, float] | None:
    """Place of a pixel of the picture as taken in the rectified one [px]; None where the lens model has none."""
    if pixel is None or lens.none:
        return pixel
    u, v = denormalise(lens.ideal(np.array([pixel]), intrinsics), intrinsics)[0].tolist()
    return (u, v) if np.isfinite((u, v)).all() else None


def raw_pixels(detection: Any, lens: Lens, frame: RgbdFrame) -> Any:
    """The detection with the end points of its lines in the picture as taken; (rho, theta) stay as they are."""
    if lens.none:
        return detection
    farthest = _FARTHEST * max(frame.rgb.shape[:2])

    def bent(line: Any) -> Any:
        if line is None:
            return None
        pixels = lens.pixels(normalise(line.pixels, frame.intrinsics), frame.intrinsics)
        return dataclasses.replace(line, pixels=np.clip(np.nan_to_num(pixels), -farthest, farthest))

    guides = {side: bent(line) for side, line in detection.guides.items()}
    return dataclasses.replace(detection, guides=guides, candidates=tuple(map(bent, detection.candidates)))
