"""What the two sides of an edge must look like: by colour, and for the border of the surface by depth as well."""

from __future__ import annotations

import itertools

import numpy as np

from ibvs_qp.vision.colors import BOARD, PAINT, SurfaceColors
from ibvs_qp.vision.profiles import Strips

#: A reading farther from the surface than this share of depth is not on it (2.6 sigma of 0.5 % + 0.5 % noise).
_OFF_PLANE = 0.018
#: What lines demand of their sides: nothing, paint beside board, border of the surface; times the surface's side.
_ANY, _PAINT_EDGE, _BORDER = 0, 1, 2


def _fits(kind: int, surface_behind: bool, labels: tuple[int, int], off: tuple[bool, bool]) -> bool:
    """Whether labels and depth before and behind an edge are those that a line demands."""
    near, far = (1, 0) if surface_behind else (0, 1)
    surface, other = labels[near], labels[far]
    if kind == _PAINT_EDGE:
        return surface == BOARD and other == PAINT
    if kind == _BORDER:
        # a wall may have the board's colour or the paint's, but not their depth; lines on the board have both
        return surface != 0 and not off[near] and (other == 0 or off[far])
    return True


#: All answers of `_fits`, read at kind, side, off behind, off before, label behind, label before, in this order.
FITS = np.array(
    [
        _fits(kind, side, (before, behind), (off_before, off_behind))
        for kind, side, off_behind, off_before, behind, before in itertools.product(
            range(3), (False, True), (False, True), (False, True), range(3), range(3)
        )
    ]
)
_LABEL_STEPS, _OFF_STEPS, _SIDE_STEP, _KIND_STEP = np.array([1, 3]), np.array([9, 18]), 36, 72


class Admissible:
    """Tells where in the strips an edge may lie.

    Attributes:
        board: Profiles of lines of kind "board", bool (L K,).
        depth_known: Whether the surface's depth can be compared with the picture's.
    """

    def __init__(self, strips: Strips, colors: SurfaceColors) -> None:
        """Take strips and the looks of the surface."""
        self._strips, self._colors = strips, colors
        kinds = [kind_of(view.query.kind, view.side, colors) for view in strips.views]
        keys = [
            _KIND_STEP * kind + _SIDE_STEP * (view.side > 0) for kind, view in zip(kinds, strips.views, strict=True)
        ]
        profiles, pixels = strips.u.shape[1], strips.colors.shape[2]
        self._judges = any(kinds)
        self._keys = np.array(keys).repeat(profiles)
        self._firsts = np.arange(0, strips.u.size * pixels, pixels)
        self.board = np.array([view.query.kind == "board" for view in strips.views]).repeat(profiles)
        self._levels = self._light()
        self.depth_known = strips.picture.depth is not None and strips.picture.plane is not None
        if self.depth_known and _BORDER in kinds:
            self._prepare_depth()
        else:
            self._depth = None

    def _light(self) -> np.ndarray | None:
        """Level of light at the middle of every profile, uint8 (L K,); None where it is even."""
        strips, found = self._strips, []
        for view, u, base in zip(strips.views, strips.u, strips.base, strict=True):
            v = np.clip(base, 0.0, view.view.height - 1.0)
            found.append(self._colors.levels_at(v, u) if view.upright else self._colors.levels_at(u, v))
        return None if self._colors.levels is None else np.concatenate(found)

    def _prepare_depth(self) -> None:
        """Place and expected 1/Z of the first pixel of every profile, and their steps from pixel to pixel."""
        strips = self._strips
        row_step, column_step, along, across, constant = np.array(
            [(view.view.row_step, view.view.column_step, *view.surface) for view in strips.views]
        ).T[:, :, None]
        first = strips.base - (strips.reach + strips.side)
        place = first * row_step + strips.u * column_step
        surface = first * across + strips.u * along + constant
        profiles = strips.u.shape[1]
        self._depth = strips.picture.depth
        self._place = place.astype(np.intp).reshape(-1)
        self._place_step = row_step.astype(np.intp)[:, 0].repeat(profiles)
        self._surface, self._surface_step = surface.reshape(-1), across[:, 0].repeat(profiles)

    def at(self, index: np.ndarray) -> np.ndarray:
        """Whether an edge may lie at one place of every profile, index (L K,) from the strip's first, bool (L K,)."""
        side = self._strips.side
        pixels = index + np.array([[0], [side], [2 * side]])
        places = self._firsts + pixels
        allowed = self._strips.hidden.reshape(-1).take(places).max(axis=0) == 0
        if not self._judges:
            return allowed
        before, behind = self._colors.label(self._strips.colors.reshape(-1, 3).take(places[::2], axis=0), self._levels)
        keys = self._keys + before
        keys += 3 * behind
        if self._depth is not None:
            before, behind = self._off(pixels[::2], np.s_[:])
            keys += 9 * before
            keys += 18 * behind
        return allowed & FITS.take(keys)

    def everywhere(self, rows: np.ndarray) -> np.ndarray:
        """The same at all places of chosen profiles (n,), bool (n, 2 reach + 1)."""
        strips, side, far = self._strips, self._strips.side, 2 * self._strips.side
        pixels = strips.colors.shape[2]
        hidden = strips.hidden.reshape(-1, pixels).take(rows, axis=0)
        allowed = (hidden[:, :-far] | hidden[:, far:] | hidden[:, side:-side]) == 0
        if not self._judges:
            return allowed
        one, three = _LABEL_STEPS.astype(np.uint8)
        labels = self._colors.label(
            strips.colors.reshape(-1, pixels, 3).take(rows, axis=0),
            None if self._levels is None else self._levels[rows, None],
        )
        keys = one * labels[:, :-far] + three * labels[:, far:]
        if self._depth is not None:
            nine, eighteen = _OFF_STEPS.astype(np.uint8)
            off = self._off(np.arange(pixels), (rows, None))
            keys += nine * off[:, :-far] + eighteen * off[:, far:]
        return allowed & FITS.take(keys + self._keys[rows, None])

    def _off(self, pixels: np.ndarray, rows) -> np.ndarray:
        """Whether pixels of profiles have a depth that is known not to be the surface's; shapes broadcast."""
        assert self._depth is not None
        z = self._depth.take(self._place[rows] + self._place_step[rows] * pixels, mode="clip")
        relative = z * (self._surface[rows] + self._surface_step[rows] * pixels)
        return (relative > 0.0) & (np.abs(relative - 1.0) > _OFF_PLANE)  # no reading: not known to be off


def kind_of(kind: str, side: int, colors: SurfaceColors) -> int:
    """What a line of some kind demands of its sides: nothing, a paint edge, or the surface's border."""
    if not kind or side == 0 or colors.board is None:
        return _ANY
    if kind == "paint":
        return _PAINT_EDGE if colors.paint_distinct else _ANY
    return _BORDER
