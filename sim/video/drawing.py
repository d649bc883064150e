"""Colours and words in a video; pictures are RGB."""

from __future__ import annotations

import cv2
import numpy as np

INK, PAPER, GRID, REFERENCE = (40, 40, 40), (250, 250, 250), (215, 215, 215), (120, 120, 120)
_LAWS = {"qp": (11, 111, 158), "paper": (213, 94, 26)}

Colour = tuple[int, int, int]


def law_ink(law: str) -> Colour:
    """Colour of a law, that of the figures."""
    return _LAWS.get(law, INK)


def write(
    image: np.ndarray, words: str, place: tuple[int, int], size: float, colour: Colour = INK, weight: int = 1
) -> None:
    """Write words with their lower left corner at (column, row)."""
    cv2.putText(image, words, place, cv2.FONT_HERSHEY_SIMPLEX, size, colour, weight, cv2.LINE_AA)


def width_of(words: str, size: float, weight: int = 1) -> int:
    """Width of words [px]."""
    return cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, size, weight)[0][0]
