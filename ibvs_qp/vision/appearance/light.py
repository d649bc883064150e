"""Uneven light: how much brighter the surface is here than there, so that a colour is compared in its own light."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ibvs_qp.vision.compilation import inner, kernel
from ibvs_qp.vision.picture.layout import Intrinsics

#: Step between two levels of light [ln]: half of it is a seventh of the gate of a white board.
LIGHT_STEP = 0.03
#: Side of a cell of the picture with one level of light, as a power of two [px].
CELL_BITS = 4
#: A colour that no other one is near to.
UNKNOWN = np.full(3, np.inf, np.float32)
#: Light of samples in which board or paint could be at all, times that in which their colour is known.
DIMMEST, BRIGHTEST = np.float32(0.4), np.float32(2.5)
#: Fraction of the gate within which a colour is the surface's however coarse its label: labels are in steps of 8.
_SURE = 0.75
#: Light that differs by less than this over the surface is even [ln]: the gate holds +-0.1 on a white board.
_UNEVEN = 0.10
#: Distance from the board's tint, fraction of the gate in that light: a mixed edge is farther.
_BOARD_TINT = 0.7
#: A channel this high is cut off, it shows neither light nor tint; and the highest there is [grey levels].
_CUT, _WHITE = 250, np.float32(255.0)
#: Light is uneven only where one level leaves out this fraction of the samples with the surface's tint.
_LEFT_OUT = 0.02
#: Least samples of the light.
_LEAST = 40
#: Light is held between these levels [steps]: 0.4 to 2.5 times the light of the reference.
_LEVELS = 30
#: A field that is already known is kept down to this difference of light, less than for a new one [ln].
_KEPT = 0.07
#: Rounds in which the field grows from where it is known: each reaches as far again as the gate allows.
_ROUNDS, _ROUNDS_KNOWN = 8, 2
#: Pull of the field's coefficients to zero, as variances of its terms: a band of the surface shows a slope, only much
#: of it a curvature.
_PULL = np.array((0.0, 1e-3, 1e-3, 4e-3, 4e-3, 4e-3))
#: Largest residual of a field, as a fraction of that of two materials in even light, see `_left_by_two_materials`.
#: Light on a board leaves 0.1 to 0.35 of it, up to 0.6 on a dark one, whose gate holds that light anyway; a grey board
#: next to a grey wall is a step, which no polynomial follows, and leaves 0.6 to 2.9, in flights before the faint board
#: 0.7 at least. Taken for light a step costs the edge.
_UNEXPLAINED = 0.5
#: The field is not continued farther than this beyond the light it was fitted to [ln].
_BEYOND = 0.06

#: A shadow scales all channels alike: a colour in it is that in the sun times a light within these, or the other way
#: round, and the sine of the angle between both is small: sky light is bluer than the sun (4 %), and noise of a pixel
#: [grey levels].
SHADED, DARKEST = 0.92, 0.12
_TINT, _TINT_NOISE = 0.055, 3.0
#: The sun that a surface mirrors adds white light, up to this [grey levels], to its own colour times a factor within
#: these. A grey surface only gets brighter; a colour has this sine from grey. The gate shrinks with the distance from
#: grey, to this fraction of it.
_MOST_GLARE, _GLARED_LEAST, _GLARED_MOST, _COLORED, _HUE = 400.0, 0.65, 1.4, 0.15, 0.3


@inner
def _squared(color):
    return color[0] * color[0] + color[1] * color[1] + color[2] * color[2]


@inner
def in_other_light(one, two):
    """Whether two colours (3,) are one in sun and in shadow."""
    ones, twos = _squared(one), _squared(two)
    darker, brighter = min(ones, twos), max(ones, twos)
    if darker < DARKEST * DARKEST * brighter or darker > SHADED * SHADED * brighter or darker <= 0.0:
        return False
    dot = one[0] * two[0] + one[1] * two[1] + one[2] * two[2]
    gate = _TINT + _TINT_NOISE / math.sqrt(darker)
    return 1.0 - dot * dot / (ones * twos) < gate * gate


@inner
def is_shaded(one, color):
    """Whether a colour (3,) is another (3,) in sun, in shadow, or in glare."""
    return in_other_light(one, color) or _is_glared(one, color)


@inner
def has_hue(color):
    """Whether a colour (3,) is far enough from grey for white light to change its tint."""
    return _chroma_squared(color) > _COLORED * _COLORED * _squared(color)


@inner
def _chroma_squared(color):
    """Squared distance of a colour from grey."""
    grey = color[0] + color[1] + color[2]
    return _squared(color) - grey * grey / 3.0


@inner
def _is_glared(one, color):
    """Whether a colour is another one with white light, one = part color + white, whose channels may be cut off."""
    if not has_hue(color) or _squared(one) < _squared(color):
        return False
    # least squares over the channels that are not cut off
    count, total, mixed, square, product = 0, 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        if one[c] < _CUT:
            count += 1
            total += color[c]
            mixed += one[c]
            square += color[c] * color[c]
            product += color[c] * one[c]
    spread = square * count - total * total
    if count < 2 or spread <= 0.0:
        return False
    part = (product * count - mixed * total) / spread
    white = (mixed - part * total) / count
    if not (_GLARED_LEAST < part < _GLARED_MOST and 0.0 < white < _MOST_GLARE):
        return False
    off = 0.0
    for c in range(3):
        left = one[c] - part * color[c] - white
        if one[c] < _CUT or left > 0.0:
            off += left * left
    gate = min(_TINT * math.sqrt(_squared(one)) + _TINT_NOISE, _HUE * part * math.sqrt(_chroma_squared(color)))
    return off < gate * gate


@kernel("b1[::1](f8[:, ::1], f8[::1])")
def _shaded(colors, color):
    """Whether colours (n, 3) are a colour (3,) in sun, in shadow, or in glare, (n,)."""
    found = np.empty(len(colors), np.bool_)
    for k in range(len(colors)):
        found[k] = is_shaded(colors[k], color)
    return found


def shaded_colors(colors: np.ndarray, color: np.ndarray) -> np.ndarray:
    """Whether colours (..., 3) are a colour (3,) in sun, in shadow, or in glare, bool (...)."""
    found = _shaded(np.ascontiguousarray(colors, float).reshape(-1, 3), np.ascontiguousarray(color, float))
    return found.reshape(colors.shape[:-1])


def squared_distance(colors: np.ndarray, reference: np.ndarray | None) -> np.ndarray:
    """Squared RGB distances of colours (..., 3) from a colour (..., 3), float32; infinite from an unknown one."""
    reference = UNKNOWN if reference is None else reference
    red, green, blue = (colors[..., k] - reference[..., k] for k in range(3))  # not at once: rows of three are slow
    return red * red + green * green + blue * blue


@dataclass(frozen=True)
class LightField:
    """Light over the picture, relative to a reference: exp of a quadratic polynomial of the place."""

    terms: np.ndarray  # coefficients of 1, x, y, x^2, x y, y^2 of normalised places over `reach`, (6,)
    range: tuple[float, float]  # least and greatest logarithm of the light in the samples
    reach: float  # largest normalised coordinate of the picture
    shape: tuple[int, int]  # (height, width) of the picture [px]
    intrinsics: Intrinsics  # (fx, fy, cx, cy) [px]

    @cached_property
    def levels(self) -> np.ndarray:
        """Level of light in every cell, from 0 for the darkest, uint8 (rows, columns), row by row."""
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
        return np.rint(self.at(np.stack((x, y), axis=-1)) / LIGHT_STEP).astype(int)

    def at(self, places: np.ndarray) -> np.ndarray:
        """Logarithm of the light at normalised places (..., 2)."""
        light = products(places / self.reach) @ self.terms
        return np.clip(light, max(self.range[0], -_LEVELS * LIGHT_STEP), min(self.range[1], _LEVELS * LIGHT_STEP))


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
    intrinsics: Intrinsics,
    before: LightField | None = None,
    *,
    paint: np.ndarray | None = None,
    anchored: bool = False,
) -> tuple[LightField, np.ndarray] | None:
    """How the light falls on the surface, grown from where the surface's colour is known.

    The logarithm of a sample's light is fitted by a quadratic polynomial to the samples within the gate of the
    prediction by the polynomial of the round before.

    Args:
        colors: Samples on the surface by depth, RGB (n, 3).
        places: Where they lie, normalised, (n, 2).
        board: Colour of the surface in the light of the reference, RGB (3,).
        gate: Distance within which a colour is the surface's in that light [grey levels].
        shape: (height, width) of the picture [px].
        intrinsics: Of the picture [px].
        before: The field of the pictures before, or None for even light.
        paint: Colour of the paint, which is left out, RGB float32 (3,), None if unknown.
        anchored: Whether the surface's colour is known, so that its light in the middle of the picture is sought too.

    Returns:
        The field and the surface's colour in its reference light; None where the light is even, or unknown.
    """
    colors, board = colors.astype(np.float32), board.astype(np.float32)
    light, cut, tinted, even = light_of(colors, board, paint, gate)
    held, count = int(np.count_nonzero(even)), int(np.count_nonzero(tinted))
    if count < _LEAST or (before is None and held >= (1.0 - _LEFT_OUT) * count):
        return None
    colors, light, places, cut = colors[tinted], light[tinted], places[tinted], cut[tinted]
    fx, fy, cx, cy = intrinsics
    reach = max(cx / fx, (shape[1] - 1 - cx) / fx, cy / fy, (shape[0] - 1 - cy) / fy)
    design, logarithm = products(places / reach), np.log(light)
    expected = np.zeros(count) if before is None else before.at(places)
    near, counted, solution = np.zeros(0, bool), np.zeros(0, bool), np.zeros(6)
    for _ in range(_ROUNDS if before is None else _ROUNDS_KNOWN):
        gain = np.exp(expected).astype(np.float32)
        near = _distances(colors, board, gain) < (gate * gain) ** 2
        # a saturated sample is at least as bright as it looks: it counts only where less was expected
        counted, previous = near & (~cut | (expected < logarithm)), counted
        if int(np.count_nonzero(counted)) < _LEAST:
            return None
        if np.array_equal(counted, previous):
            break
        part = design[counted]
        solution = np.linalg.solve(part.T @ part + len(part) * np.diag(_PULL), part.T @ logarithm[counted])
        expected = design @ solution
    left = float(np.abs((logarithm - expected)[counted]).sum())
    band = _SURE * gate / max(float(board @ board), 1.0) ** 0.5
    if left > _UNEXPLAINED * _left_by_two_materials(logarithm[counted], band):
        return None
    if not anchored:
        expected, solution[0] = expected - solution[0], 0.0
    low, high = np.percentile(expected[near], (2.0, 98.0)).tolist()
    if high - low < (_UNEVEN if before is None else _KEPT):
        return None
    if before is None and int(np.count_nonzero(near)) * (1.0 - _LEFT_OUT) <= held:
        return None
    whole = near & ~cut
    if int(np.count_nonzero(whole)) >= _LEAST:
        board = np.median(colors[whole] / np.exp(expected[whole])[:, None], axis=0).astype(np.float32)
    return LightField(solution, (low - _BEYOND, high + _BEYOND), reach, shape, intrinsics), board


def light_of(
    colors: np.ndarray, board: np.ndarray, paint: np.ndarray | None, gate: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """In which light the board would look like each sample, float32 (n, 3), times the reference's, (n,).

    With it, (n,) each: which samples are cut off, which have the board's tint (3,) in some light or are cut off, and
    which of these have its colour, within the gate, in the reference's light. The paint has not the board's tint.
    """
    (red, green, blue), (b_red, b_green, b_blue) = colors.T, board
    size = max(b_red * b_red + b_green * b_green + b_blue * b_blue, np.float32(1.0))
    light = (red * b_red + green * b_green + blue * b_blue) / size
    off = np.maximum(red * red + green * green + blue * blue - light * light * size, np.float32(0.0))
    tint = np.float32(_BOARD_TINT * gate) * light
    cut = np.maximum(np.maximum(red, green), blue) >= _CUT
    tinted = cut | ((light > DIMMEST) & (light < BRIGHTEST) & (off < tint * tint))
    tinted &= squared_distance(colors, paint) > np.float32(gate * gate)
    # a dark board's colour holds in much light, the paint's on it does not
    even = tinted & (squared_distance(colors, np.minimum(board, _WHITE)) < np.float32((_SURE * gate) ** 2))
    even &= np.abs(light - np.float32(1.0)) < np.float32(_UNEVEN)
    return light, cut, tinted, even


def _left_by_two_materials(logarithm: np.ndarray, band: float) -> float:
    """Sum of distances of samples (n,) from the level of their material, the surface's or another one beyond the gate.

    The other is darker or brighter by more than the band, whichever leaves less. Smooth light has every level in
    between, so that this leaves its slope; materials have one level each, and leave noise alone.
    """
    left = []
    for split in (-band, band):
        above = logarithm > split
        count = int(np.count_nonzero(above))
        total, bright = float(logarithm.sum()), float(logarithm @ above)
        levels = np.array(((total - bright) / max(len(logarithm) - count, 1), bright / max(count, 1)))
        left.append(float(np.abs(logarithm - levels[above.view(np.int8)]).sum()))
    return min(left)


def _distances(colors: np.ndarray, board: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Squared distances of colours (n, 3) from the surface's in light (n,), as far as the picture can show it."""
    difference = colors - np.minimum(light[:, None] * board, _WHITE)
    return np.vecdot(difference, difference)
