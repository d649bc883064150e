"""Noise drawn once and read from random offsets: a new draw for every pixel would cost more than the picture."""

from __future__ import annotations

import cv2
import numpy as np

#: Colour noise of the sensor [grey levels] (design, section 5: two grey levels).
RGB_SIGMA = 2.0
#: Correlation length of the depth noise [px], and standard deviation of its common mode [m].
DEPTH_CORRELATION_PX, DEPTH_COMMON_SIGMA_M = 20.0, 0.001
#: Rows added to the banks; a frame starts at a random offset within them [px].
_SPARE_ROWS = 128


class NoiseBank:
    """Colour and depth noise of one camera.

    Args:
        shape: (height, width) of the picture [px].
        depth_relative: Standard deviation of the white, and again of the correlated, depth noise per depth.
        rng: Source of the banks and of the offsets.
    """

    def __init__(self, shape: tuple[int, int], depth_relative: float, rng: np.random.Generator) -> None:
        self._shape, self._rng = shape, rng
        height, width = shape
        rows = height + _SPARE_ROWS
        grey = np.rint(RGB_SIGMA * rng.standard_normal(rows * width * 3, np.float32)).astype(np.int8)
        # OpenCV's saturating arithmetic is fast on unsigned numbers, so the two signs are stored separately.
        self._brighter, self._darker = np.maximum(grey, 0).astype(np.uint8), np.maximum(-grey, 0).astype(np.uint8)
        # White noise blurred with this Gaussian is correlated over DEPTH_CORRELATION_PX (1/e at 2 sigma).
        shape = (rows, 2 * width)
        self._factors = rng.standard_normal(shape, np.float32)
        self._factors *= np.float32(depth_relative)
        blurred = cv2.GaussianBlur(rng.standard_normal(shape, np.float32), (0, 0), 0.5 * DEPTH_CORRELATION_PX)
        self._factors += blurred * np.float32(depth_relative / float(blurred.std()))
        self._factors += np.float32(1.0)
        self._lifted = np.empty((height, width * 3), np.uint8)

    def add_color(self, picture: np.ndarray) -> np.ndarray:
        """A new picture with noise added, uint8 (H, W, 3)."""
        height, width = self._shape
        size = height * width * 3
        start = int(self._rng.integers(len(self._brighter) - size))
        noisy = np.empty((height, width, 3), np.uint8)
        flat = noisy.reshape(height, -1)
        cv2.add(picture.reshape(height, -1), self._brighter[start : start + size].reshape(height, -1), self._lifted)
        cv2.subtract(self._lifted, self._darker[start : start + size].reshape(height, -1), flat)
        return noisy

    def add_white_depth(self, relative: float, rng: np.random.Generator) -> None:
        """Add white depth noise of a standard deviation per depth to the bank."""
        self._factors += rng.standard_normal(self._factors.shape, np.float32) * np.float32(relative)

    def depth_factor(self) -> np.ndarray:
        """Factor 1 + white + correlated noise of one frame, float32 (H, W), not to be written."""
        height, width = self._shape
        row, column = int(self._rng.integers(_SPARE_ROWS)), int(self._rng.integers(width))
        return self._factors[row : row + height, column : column + width]

    def depth_common(self) -> float:
        """Common-mode depth error of one frame [m]."""
        return float(self._rng.normal(0.0, DEPTH_COMMON_SIGMA_M))
