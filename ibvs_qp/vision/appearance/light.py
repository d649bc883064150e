"""Uneven light: how much brighter the surface is here than there, so that a colour is judged by what lights it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ibvs_qp.vision.appearance.light_samples import LEAST, LEFT_OUT, distances, is_even, left_by_two_materials
from ibvs_qp.vision.kernels.colors import SURE, UNEVEN, light_of
from ibvs_qp.vision.kernels.labels import CELL_BITS, UNKNOWN

#: Step between two levels of light [ln]: half of it is a seventh of the gate of a white board.
STEP = 0.03
#: Light is held between these levels [steps]: 0.4 to 2.5 times the light of the reference.
_LEVELS = 30
#: A field that is already known is kept down to this difference of light, less than what makes a new one [ln].
_KEPT = 0.07
#: Rounds in which the field grows from where it is known: each reaches as far again as the gate allows.
_ROUNDS, _ROUNDS_KNOWN = 8, 2
#: Pull of the field's coefficients to zero, as variances of its terms: a band of the surface tells a slope, only much
#: of it a curvature.
_PULL = np.array((0.0, 1e-3, 1e-3, 4e-3, 4e-3, 4e-3))
#: What a field may leave of what two materials in even light leave, see `left_by_two_materials`. Light on a board
#: leaves 0.1 to 0.35 of it, up to 0.6 on a dark one, whose gate holds that light anyway; a grey board beside a grey
#: wall is a step, which no polynomial follows, and leaves 0.6 to 2.9, in flights before the faint board 0.7 at least.
#: Taken for light a step costs the edge.
_UNEXPLAINED = 0.5
#: The field is not continued farther than this beyond the light it was fitted to [ln].
_BEYOND = 0.06


@dataclass(frozen=True)
class LightField:
    """Light over the picture, relative to a reference: exp of a quadratic polynomial of the place.

    Attributes:
        terms: Coefficients of 1, x, y, x^2, x y, y^2 of normalised places over `reach`, (6,).
        range: Least and greatest logarithm of the light, by what was seen.
        reach: Largest normalised coordinate of the picture.
        shape: (height, width) of the picture [px].
        intrinsics: (fx, fy, cx, cy) [px].
    """

    terms: np.ndarray
    range: tuple[float, float]
    reach: float
    shape: tuple[int, int]
    intrinsics: tuple[float, float, float, float]

    @cached_property
    def levels(self) -> np.ndarray:
        """Level of light in every cell, from 0 for the darkest, uint8 (rows, columns), rows one after the other."""
        steps = self._steps
        return np.ascontiguousarray(steps - steps.min(), np.uint8)

    @cached_property
    def steps(self) -> tuple[int, ...]:
        """Logarithm of the light of every level, in steps."""
        return tuple(range(int(self._steps.min()), int(self._steps.max()) + 1))

    @cached_property
    def _steps(self) -> np.ndarray:
        height, width = self.shape
        fx, fy, cx, cy = self.intrinsics
        side = 1 << CELL_BITS
        u, v = (np.arange(0, size, side) + 0.5 * (side - 1) for size in (width, height))
        x, y = np.meshgrid((u - cx) / fx, (v - cy) / fy)
        return np.rint(self.at(np.stack((x, y), axis=-1)) / STEP).astype(int)

    def at(self, places: np.ndarray) -> np.ndarray:
        """Logarithm of the light at normalised places (..., 2)."""
        light = products(places / self.reach) @ self.terms
        return np.clip(light, max(self.range[0], -_LEVELS * STEP), min(self.range[1], _LEVELS * STEP))

    def levels_at(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Level of light at pixels, uint8 of their shape."""
        height, width = self.shape
        row = np.clip(np.asarray(v).astype(np.intp), 0, height - 1) >> CELL_BITS
        return self.levels[row, np.clip(np.asarray(u).astype(np.intp), 0, width - 1) >> CELL_BITS]


def products(places: np.ndarray) -> np.ndarray:
    """1, x, y, x^2, x y, y^2 of places (..., 2), (..., 6)."""
    x, y = places[..., 0], places[..., 1]
    return np.stack((np.ones_like(x), x, y, x * x, x * y, y * y), axis=-1)


def fit_light(
    colors: np.ndarray,
    places: np.ndarray,
    board: np.ndarray,
    gate: float,
    shape: tuple[int, int],
    intrinsics: tuple[float, float, float, float],
    before: LightField | None = None,
    *,
    paint: np.ndarray = UNKNOWN,
    anchored: bool = False,
) -> tuple[LightField, np.ndarray] | None:
    """How the light falls on the surface, grown from where the surface's colour is known.

    The logarithm of a sample's light is fitted by a quadratic polynomial to the samples within the gate of what the
    polynomial of the round before expects.

    Args:
        colors: Samples on the surface by depth, RGB (n, 3).
        places: Where they lie, normalised, (n, 2).
        board: Colour of the surface in the light of the reference, RGB (3,).
        gate: Distance within which a colour is the surface's in that light [grey levels].
        shape: (height, width) of the picture [px].
        intrinsics: Of the picture [px].
        before: The field of the pictures before, or None for even light.
        paint: Colour of the paint, which is left out, RGB float32 (3,), empty if unknown.
        anchored: Whether the surface's colour is known, so that its light in the middle of the picture is sought too.

    Returns:
        The field and the surface's colour in its reference light; None where the light is even, or cannot be told.
    """
    colors, board = colors.astype(np.float32), board.astype(np.float32)
    light, cut, tinted, even = light_of(colors, board, paint, gate)
    held, count = int(np.count_nonzero(even)), int(np.count_nonzero(tinted))
    if count < LEAST or (before is None and is_even(held, count)):
        return None
    colors, light, places, cut = colors[tinted], light[tinted], places[tinted], cut[tinted]
    fx, fy, cx, cy = intrinsics
    reach = max(cx / fx, (shape[1] - 1 - cx) / fx, cy / fy, (shape[0] - 1 - cy) / fy)
    design, logarithm = products(places / reach), np.log(light)
    expected = np.zeros(count) if before is None else before.at(places)
    near, telling, solution = np.zeros(0, bool), np.zeros(0, bool), np.zeros(6)
    for _ in range(_ROUNDS if before is None else _ROUNDS_KNOWN):
        gain = np.exp(expected).astype(np.float32)
        near = distances(colors, board, gain) < (gate * gain) ** 2
        # what is cut off is at least as bright as it looks: it tells something only where less was expected
        telling, told = near & (~cut | (expected < logarithm)), telling
        if int(np.count_nonzero(telling)) < LEAST:
            return None
        if np.array_equal(telling, told):
            break
        part = design[telling]
        solution = np.linalg.solve(part.T @ part + len(part) * np.diag(_PULL), part.T @ logarithm[telling])
        expected = design @ solution
    left = float(np.abs((logarithm - expected)[telling]).sum())
    band = SURE * gate / max(float(board @ board), 1.0) ** 0.5
    if left > _UNEXPLAINED * left_by_two_materials(logarithm[telling], band):
        return None
    if not anchored:
        expected, solution[0] = expected - solution[0], 0.0
    low, high = np.percentile(expected[near], (2.0, 98.0)).tolist()
    if high - low < (UNEVEN if before is None else _KEPT):
        return None
    if before is None and int(np.count_nonzero(near)) * (1.0 - LEFT_OUT) <= held:
        return None
    whole = near & ~cut
    if int(np.count_nonzero(whole)) >= LEAST:
        board = np.median(colors[whole] / np.exp(expected[whole])[:, None], axis=0).astype(np.float32)
    return LightField(solution, (low - _BEYOND, high + _BEYOND), reach, shape, intrinsics), board
