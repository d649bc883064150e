"""Steps of the automatic exposure, taken out before colours are compared."""

from __future__ import annotations

import math

import cv2
import numpy as np

from ibvs_qp.vision.medians import middle

#: Brightness of two pictures is compared at every so many pixels, below this grey value: saturated ones do not change.
_COMPARED, _UNSATURATED = 16, 250
#: Least fraction of these pixels that must be unsaturated in both pictures.
_LEAST = 0.05
#: A relative change of brightness from picture to picture below this one is no step: motion and noise look like it [-].
_STEP = 0.03
#: Time in which the learnt colours follow a new exposure by themselves [s].
_FADE_S = 5.0
#: Pictures farther apart than this are not compared [s].
_LONGEST_GAP = 0.2


class ExposureSteps:
    """Gain of the exposure since the colours were learnt.

    A step changes all pixels by one factor between two pictures; the camera's motion does not. Colours are compared on
    pictures at the exposure before the step, and the gain fades as they follow.

    Attributes:
        gain: Brightness of the present picture over that of the reference.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the picture before."""
        self.gain, self._stamp_ns = 1.0, 0
        self._last: np.ndarray | None = None

    def level(self, rgb: np.ndarray, stamp_ns: int) -> np.ndarray:
        """The picture at the reference's exposure, uint8 (H, W, 3); the same array while there is no step."""
        small = rgb[::_COMPARED, ::_COMPARED].transpose(2, 0, 1).copy()
        interval, self._stamp_ns = (stamp_ns - self._stamp_ns) * 1e-9, stamp_ns
        last, self._last = self._last, small
        if last is None or last.shape != small.shape or not 0.0 < interval <= _LONGEST_GAP:
            self.gain = 1.0
            return rgb
        ratio = brightness_ratio(last, small)
        if abs(ratio - 1.0) > _STEP:
            self.gain *= ratio
        self.gain **= math.exp(-interval / _FADE_S)
        return rgb if abs(self.gain - 1.0) <= _STEP else cv2.convertScaleAbs(rgb, alpha=1.0 / self.gain)


def brightness_ratio(before: np.ndarray, after: np.ndarray) -> float:
    """Median ratio of the pixels' brightness of two pictures, uint8 (3, h, w); 1 where nearly all are saturated."""
    usable = np.maximum(before.max(axis=0), after.max(axis=0)) < _UNSATURATED
    ratios = ((after.sum(axis=0) + 1.0) / (before.sum(axis=0) + 1.0))[usable]
    return middle(ratios) if len(ratios) >= _LEAST * usable.size else 1.0
