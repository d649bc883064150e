"""Fits of a batch of lines in their strips, in plain numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ibvs_qp.vision.lines.query import LineView


@dataclass(frozen=True, slots=True)
class LineFit:
    """A line v = level + slope (u - center), in plain numbers: arrays of a few elements cost ten times as much.

    Attributes:
        level: Row at the centre [px].
        slope: Rows per column.
        center: Weighted mean of u [px].
        level_variance: Of the level [px^2]: sigma^2/N, inflated where neighbouring residuals agree.
        slope_variance: Of the slope: sigma^2/N 12/L^2, inflated the same.
        rms: Of the residuals [px].
    """

    level: float
    slope: float
    center: float
    level_variance: float
    slope_variance: float
    rms: float


@dataclass(frozen=True)
class Profiles:
    """Where the profiles of a batch of L lines lie: K columns of every line.

    Attributes:
        views: The lines, each level in its own view, (L).
        u: Columns of the profiles, (L, K).
        side: Distance of the two sides from the edge [px].
    """

    views: list[LineView]
    u: np.ndarray
    side: int


@dataclass
class Fits:
    """Results of a batch of L lines with K profiles, each in its own view.

    Attributes:
        lines: The fitted lines.
        support: Profiles that agree, bool (L, K).
        visible: Profiles that could be seen, bool (L, K).
        count: How many agree, (L).
        seen: Profiles within the run that agree or could be seen, (L).
        runs: First and last supporting profile, (L).
        steps: Colour behind minus colour before, along +v, (L) of 3.
        alive: Whether there is a line at all, (L).
    """

    lines: list[LineFit]
    support: np.ndarray
    visible: np.ndarray
    count: list[int]
    seen: list[int]
    runs: list[tuple[int, int]]
    steps: list[list[float]]
    alive: list[bool]


class Fitted(NamedTuple):
    """Results of one call.

    Attributes:
        fits: The lines.
        profiles: Where their profiles lie.
        sides: Colours before and behind every line at its profiles, uint8 (2, L, K, 3), or None.
    """

    fits: Fits
    profiles: Profiles
    sides: np.ndarray | None
