"""Relief of the wall: rivets, seams and steps, as heights over the chart."""

from __future__ import annotations

import math

import numpy as np

from sim.world.board import BoardGeometry
from sim.world.errors import ReliefErrors
from sim.world.random_streams import stream

#: Radius of a rivet's head, half width of a seam, width of the ramp of a step [m]: the brush rounds them off.
RIVET_M, SEAM_M, STEP_M = 0.012, 0.010, 0.010


class Relief:
    """Heights of a board's face, drawn from the flight's seed.

    Rivets lie at random places, seams run upwards, a step runs upwards and raises the board beyond it.

    Args:
        errors: Numbers and heights.
        board: The board.
        seed: Seed of the flight.
    """

    def __init__(self, errors: ReliefErrors, board: BoardGeometry, seed: int) -> None:
        size, draw = board.scene.board, stream(seed, "errors.relief")
        rivets = round(errors.rivets_per_m2 * size.width_m * size.height_m)
        self._rivets = draw.uniform((0.0, 0.0), (size.width_m, size.height_m), (rivets, 2))
        seams = round(errors.seams_per_m * size.width_m)
        self._seams = draw.uniform(0.0, size.width_m, seams)
        low, high = errors.height_m
        self._rivet_m, self._seam_m = draw.uniform(low, high, rivets), draw.uniform(low, high, seams)
        self._step_at, self._step_m = float(draw.uniform(0.2, 0.8)) * size.width_m, errors.step_m

    def height(self, along: float, up: float) -> tuple[float, float, float]:
        """Height towards the vehicle at a place of the board [m], and its slopes along and up.

        Args:
            along: To the right of the board's left edge [m].
            up: Above its bottom edge [m].
        """
        height = slope_along = slope_up = 0.0
        if len(self._rivets):
            right, high = along - self._rivets[:, 0], up - self._rivets[:, 1]
            way = np.hypot(right, high)
            for index in np.flatnonzero(way < RIVET_M).tolist():
                bump, slope = _bump(float(way[index]), RIVET_M, float(self._rivet_m[index]))
                height += bump
                if way[index] > 0.0:
                    slope_along += slope * float(right[index] / way[index])
                    slope_up += slope * float(high[index] / way[index])
        for index in np.flatnonzero(np.abs(along - self._seams) < SEAM_M).tolist():
            aside = along - float(self._seams[index])
            bump, slope = _bump(abs(aside), SEAM_M, float(self._seam_m[index]))
            height, slope_along = height + bump, slope_along + slope * math.copysign(1.0, aside)
        if self._step_m:
            ramp = min(max((along - self._step_at) / STEP_M, 0.0), 1.0)
            height += self._step_m * 0.5 * (1.0 - math.cos(math.pi * ramp))
            if 0.0 < ramp < 1.0:
                slope_along += self._step_m * 0.5 * math.pi / STEP_M * math.sin(math.pi * ramp)
        return height, slope_along, slope_up


def _bump(way: float, radius: float, height: float) -> tuple[float, float]:
    """Height of a round bump at a way from its middle [m], and its slope outwards."""
    phase = math.pi * way / radius
    return 0.5 * height * (1.0 + math.cos(phase)), -0.5 * height * math.pi / radius * math.sin(phase)
