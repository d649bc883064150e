"""The board's face as a picture that a round brush paints on, and the picture of the wall behind it.

Board coordinates are (along, up) metres from the bottom left corner (`sim.world.board`). Pixel (row, column) of the
board picture covers the square whose centre is along = (column + 0.5) / p, up = height - (row + 0.5) / p with
p = `Canvas.pixels_per_m`: row 0 is the top edge, column 0 the left edge.
"""

from __future__ import annotations

import functools
import math

import cv2
import numpy as np

from sim.world import textures
from sim.world.board import BoardGeometry
from sim.world.clutter import clutter_board, clutter_wall
from sim.world.painted_edges import BoardPoint, PaintedEdges
from sim.world.scene import Scene

#: Wall picture: resolution [px/m] and extent beyond the board's outline [m].
WALL_PIXELS_PER_M, WALL_EXTENT_M = 500.0, 1.3
#: Largest texture [px]; larger boards get a coarser picture, which bounds the memory.
_MAX_PIXELS = 12e6
_RIM_M = 0.006
#: The texture goes on beyond the outline by this much, so that its rim can be drawn without samples from outside [px].
TEXTURE_PAD_PX = 8
#: Sub-pixel positions of the brush stamp per axis, and distance between stamps [px]: 2^2 / (8 r) = 0.01 px of scallop.
_PHASES, _STAMP_STEP_PX = 16, 2.0
#: Stamps drawn together: one by one, each would wait for its pixels' memory [-].
_STAMPS_AT_ONCE = 64


#: Rows and columns of the padded texture: (row, row end, column, column end).
Box = tuple[int, int, int, int]


class Canvas:
    """Board and wall pictures of one flight.

    Strokes change the paint coverage of the pixels; `refresh` mixes the texture from it when a camera needs it.

    Args:
        scene: The scene.
        seed: Seed of the flight; with the scene's texture seeds it decides grain and clutter.
        pixels_per_m: Resolution of the board picture [px/m].
    """

    def __init__(self, scene: Scene, seed: int, pixels_per_m: float = 1000.0) -> None:
        board, paint = scene.board, scene.paint
        self.scene, self.geometry = scene, BoardGeometry(scene)
        self.pixels_per_m = min(pixels_per_m, math.sqrt(_MAX_PIXELS / (board.width_m * board.height_m)))
        self._seeds = [
            np.random.SeedSequence([part, board.texture_seed, scene.wall.texture_seed, seed]) for part in range(3)
        ]
        self._shape = _whole(board.height_m * self.pixels_per_m), _whole(board.width_m * self.pixels_per_m)
        pad = TEXTURE_PAD_PX
        padded = (self._shape[0] + 2 * pad, self._shape[1] + 2 * pad)
        self._coverage, self._drawn = np.zeros(padded, np.uint8), np.zeros(padded, np.uint8)
        self._stamps = _brush_stamps(0.5 * paint.brush_width_m * self.pixels_per_m)
        self._coming: list[tuple[float, float]] = []  # (column, row) of stamps that are still to be drawn
        self._dirty: Box | None = None
        self.edges = PaintedEdges(scene)

    def _surface_source(self) -> tuple[np.random.Generator, int]:
        """Source of the board's grain, and how many of the distracting objects lie on the board."""
        rng = np.random.default_rng(self._seeds[0])
        return rng, int(rng.binomial(self.scene.board.clutter, 0.5))

    # Pictures are lazy: a flight without a camera needs none of them.

    @functools.cached_property
    def _blank(self) -> np.ndarray:
        """The board before it is painted, padded, uint8 (h, w, 4)."""
        rng, on_board = self._surface_source()
        face = textures.board_surface(
            rng, self._shape, self.scene.board.color, max(1, round(_RIM_M * self.pixels_per_m))
        )
        clutter_board(rng, face, on_board, self.pixels_per_m)
        pad = TEXTURE_PAD_PX
        return cv2.copyMakeBorder(face, pad, pad, pad, pad, cv2.BORDER_REPLICATE)

    @functools.cached_property
    def texture(self) -> np.ndarray:
        """The board as painted at the last `refresh`, `TEXTURE_PAD_PX` pixels larger on every side, uint8 (h, w, 4)."""
        return self._blank.copy()

    @functools.cached_property
    def _fresh(self) -> np.ndarray:
        """The board as if it were painted all over, padded, uint8 (h, w, 4)."""
        return textures.paint_surface(
            np.random.default_rng(self._seeds[2]), self._coverage.shape, self.scene.paint.color
        )

    @functools.cached_property
    def _wall(self) -> tuple[np.ndarray, np.ndarray, float]:
        board, rng = self.scene.board, np.random.default_rng(self._seeds[1])
        corners = self.geometry.point(np.array([0, 1, 1, 0]) * board.width_m, np.array([0, 0, 1, 1]) * board.height_m)
        low, high = corners.min(axis=0), corners.max(axis=0)
        size = high - low + 2.0 * WALL_EXTENT_M
        px_m = min(WALL_PIXELS_PER_M, math.sqrt(_MAX_PIXELS / float(np.prod(size))))
        origin = low - WALL_EXTENT_M
        width, height = (math.ceil(entry * px_m) for entry in size)
        wall = textures.wall_surface(rng, (height, width), self.scene.wall.color, px_m)
        left, top = (low - origin) * px_m
        right, bottom = (high - origin) * px_m
        clutter_wall(rng, wall, board.clutter - self._surface_source()[1], px_m, (left, top, right, bottom))
        return wall, origin, px_m

    @property
    def wall(self) -> np.ndarray:
        """The wall around and behind the board, uint8 (h, w, 4)."""
        return self._wall[0]

    @property
    def wall_origin(self) -> np.ndarray:
        """World (y, z) of the wall picture's upper left corner [m], (2,)."""
        return self._wall[1]

    @property
    def wall_pixels_per_m(self) -> float:
        """Resolution of the wall picture [px/m]."""
        return self._wall[2]

    @property
    def rgb(self) -> np.ndarray:
        """The painted board, uint8 RGB (height, width, 3), a copy."""
        # Not from `texture`: its refresh reports the changed box, which a camera needs.
        self._draw_stamps()
        coverage, fresh, blank = _inner(self._coverage), _inner(self._fresh), _inner(self._blank)
        picture = blank[..., :3].copy()
        painted = coverage > 0
        picture[painted] = _mix(coverage[painted], fresh[painted], blank[painted])[:, :3]
        return picture

    @property
    def coverage(self) -> np.ndarray:
        """Fraction of every pixel that is painted, float32 0..1, (height, width)."""
        self._draw_stamps()
        return _inner(self._coverage).astype(np.float32) / np.float32(255.0)

    @property
    def painted(self) -> np.ndarray:
        """Painted fraction in 255ths of the padded `texture`, uint8 (h, w), not to be written."""
        self._draw_stamps()
        return self._coverage

    def thumbnail(self, pixels_per_m: float) -> np.ndarray:
        """Painted fraction in 255ths at a coarser resolution, uint8."""
        self._draw_stamps()
        part = pixels_per_m / self.pixels_per_m
        return cv2.resize(_inner(self._coverage), None, fx=part, fy=part, interpolation=cv2.INTER_AREA)

    def stroke(self, previous: BoardPoint | None, current: BoardPoint) -> None:
        """Move the pressed round brush from ``previous`` to ``current``, or dab it down where ``previous`` is None.

        Stamps of an antialiased disc two pixels apart leave a straight edge; lines drawn segment by segment with
        whole-pixel thickness would not.

        Args:
            previous: Board coordinates (along, up) of the last stroke's end [m], or None.
            current: Board coordinates (along, up) of the brush centre now [m].
        """
        self.edges.stroke(previous, current)
        scale, height = self.pixels_per_m, self.scene.board.height_m
        shift = TEXTURE_PAD_PX - 0.5
        column, row = float(current[0]) * scale + shift, (height - float(current[1])) * scale + shift
        stamps = self._coming
        if previous is None:
            stamps.append((column, row))
            return
        from_column, from_row = float(previous[0]) * scale + shift, (height - float(previous[1])) * scale + shift
        steps = max(1, math.ceil(math.hypot(column - from_column, row - from_row) / _STAMP_STEP_PX))
        for k in range(1, steps + 1):
            part = k / steps
            stamps.append((from_column + part * (column - from_column), from_row + part * (row - from_row)))
        if len(stamps) >= _STAMPS_AT_ONCE:
            self._draw_stamps()

    def _draw_stamps(self) -> None:
        for column, row in self._coming:
            self._stamp(column, row)
        self._coming.clear()

    def _stamp(self, column: float, row: float) -> None:
        phase_column, phase_row = round(column * _PHASES), round(row * _PHASES)
        stamp = self._stamps[phase_row % _PHASES][phase_column % _PHASES]
        size, (height, width) = len(stamp), self._coverage.shape
        left, top = phase_column // _PHASES - size // 2, phase_row // _PHASES - size // 2
        c0, c1, r0, r1 = left, left + size, top, top + size
        if left < 0 or top < 0 or c1 > width or r1 > height:
            c0, c1, r0, r1 = max(left, 0), min(c1, width), max(top, 0), min(r1, height)
            if c0 >= c1 or r0 >= r1:
                return
            stamp = stamp[r0 - top : r1 - top, c0 - left : c1 - left]
        patch = self._coverage[r0:r1, c0:c1]
        np.maximum(patch, stamp, out=patch)
        old = self._dirty
        self._dirty = (
            (r0, r1, c0, c1) if old is None else (min(old[0], r0), max(old[1], r1), min(old[2], c0), max(old[3], c1))
        )

    def refresh(self) -> Box | None:
        """Bring `texture` up to date with all strokes; returns the changed part, or None."""
        self._draw_stamps()
        box, self._dirty = self._dirty, None
        if box is None:
            return None
        r0, r1, c0, c1 = box
        coverage, drawn = self._coverage[r0:r1, c0:c1], self._drawn[r0:r1, c0:c1]
        changed = np.flatnonzero(coverage != drawn)  # a brush's front is narrow
        rows, columns = np.divmod(changed, c1 - c0)
        place = (rows + r0) * self._drawn.shape[1] + (columns + c0)
        fresh, blank = _pixels(self._fresh).take(place), _pixels(self._blank).take(place)
        fraction = coverage[rows, columns]
        mixed = _mix(fraction, fresh.view(np.uint8).reshape(-1, 4), blank.view(np.uint8).reshape(-1, 4))
        _pixels(self.texture)[place] = mixed.view(np.uint32).reshape(-1)
        drawn[:] = coverage
        return box

    def flush(self) -> np.ndarray:
        """The up-to-date `texture`."""
        self.refresh()
        return self.texture


def _pixels(picture: np.ndarray) -> np.ndarray:
    """The pixels of a picture, uint8 (h, w, 4), as whole numbers, uint32 (h * w,); shared."""
    return picture.view(np.uint32).reshape(-1)


def _mix(fraction: np.ndarray, fresh: np.ndarray, blank: np.ndarray) -> np.ndarray:
    """Paint over ground: pixels uint8 (n, 4) by the fraction of the paint in 255ths, uint8 (n,)."""
    wide = fraction[:, None].astype(np.uint16)
    return ((fresh * wide + blank * (255 - wide) + 127) // 255).astype(np.uint8)


def _whole(size: float) -> int:
    """Pixels needed for a size, forgiving rounding errors of the product."""
    return math.ceil(size - 1e-6)


def _inner(padded: np.ndarray) -> np.ndarray:
    return padded[TEXTURE_PAD_PX:-TEXTURE_PAD_PX, TEXTURE_PAD_PX:-TEXTURE_PAD_PX]


@functools.lru_cache(maxsize=4)
def _brush_stamps(radius_px: float) -> list[list[np.ndarray]]:
    """Antialiased discs at every sub-pixel position, uint8, indexed [row phase][column phase]."""
    half = math.ceil(radius_px) + 2
    grid = np.arange(-half, half + 1, dtype=np.float32)
    offsets = np.arange(_PHASES, dtype=np.float32) / _PHASES
    stamps = []
    for row in offsets:
        line = []
        for column in offsets:
            distance = np.sqrt((grid[:, None] - row) ** 2 + (grid[None, :] - column) ** 2)
            line.append(np.rint(255.0 * np.clip(radius_px + 0.5 - distance, 0.0, 1.0)).astype(np.uint8))
            line[-1].flags.writeable = False  # shared by all flights
        stamps.append(line)
    return stamps
