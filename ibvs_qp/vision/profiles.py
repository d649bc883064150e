"""Strips of colour across a predicted line: where each profile has its edge, to a fraction of a pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.colors import BOARD, PAINT, SurfaceColors
from ibvs_qp.vision.picture import Picture

#: Distance from the edge at which its two sides are looked at [px at 640]: beyond blur, within a 10 mm margin.
SIDE_PX = 4.0
#: Width of the preference for the predicted place, share of the strip.
_PREFERENCE = 0.6
#: A reading farther from the surface than this share of depth is not on it (2.6 sigma of 0.5 % + 0.5 % noise).
_OFF_PLANE = 0.018
#: A neighbour's gradient counts at least this share of the peak, so that the logarithm stays tame.
_FLOOR = 0.05


@dataclass(frozen=True, kw_only=True)
class Expected:
    """What lies on the two sides of a line whose identity is known (before and behind, along +v).

    Attributes:
        kind: "board", "paint" or "" for anything.
        side: +1 if the surface lies behind (larger v), -1 before, 0 unknown.
    """

    kind: str = ""
    side: int = 0


@dataclass
class Strip:
    """Colour around a predicted level line v = v(u), one column of pixels per profile."""

    u: np.ndarray
    base: np.ndarray
    colors: np.ndarray
    hidden: np.ndarray
    reach: int
    side: int
    off: np.ndarray | None

    @classmethod
    def gather(
        cls,
        picture: Picture,
        coefficients: tuple[float, float, float],
        span: tuple[float, float],
        profiles: int,
        reach: int,
    ) -> Strip | None:
        """Read the strip within `reach` rows of the line between two columns; None if it misses the picture."""
        height, width = picture.height, picture.width
        first, last = max(span[0], 0.0), min(span[1], width - 1.0)
        if last - first < profiles // 8:
            return None
        side = max(2, round(SIDE_PX * picture.scale))
        u = np.unique(np.round(np.linspace(first, last, profiles)).astype(np.intp))
        p, q, r = coefficients
        base = np.round(-(p * u + r) / q).astype(np.intp)
        rows = base[:, None] + np.arange(-reach - side, reach + side + 1)
        outside = (rows < 0) | (rows >= height)
        np.minimum(np.maximum(rows, 0, out=rows), height - 1, out=rows)
        place = rows * picture.row_step + (u * picture.column_step)[:, None]
        colors = picture.colors.take(place, axis=0)
        hidden = (picture.hidden.take(place) != 0) | outside
        off = None
        if picture.depth is not None and picture.plane is not None:
            a, b, c = picture.plane
            fx, fy, cx, cy = picture.intrinsics
            relative = picture.depth.take(place) * (
                rows * (b / fy) + (u * (a / fx) + (c - a * cx / fx - b * cy / fy))[:, None]
            )
            off = np.where(
                relative > 0.0, np.abs(relative - 1.0) > _OFF_PLANE, False
            )  # no reading: not known to be off
        return cls(u=u, base=base, colors=colors, hidden=hidden, reach=reach, side=side, off=off)

    @property
    def visible(self) -> np.ndarray:
        """Profiles whose middle is neither hidden nor outside, bool (K,)."""
        middle = self.reach + self.side
        return np.logical_not(self.hidden[:, middle - 2 : middle + 3].any(axis=1))

    def gradient(self) -> np.ndarray:
        """Central differences along +v of the three channels, (K, 2 reach + 1, 3) [grey levels per px]."""
        cut = self.side - 1
        inner = self.colors[:, cut : self.colors.shape[1] - cut].astype(np.float32)
        return 0.5 * (inner[:, 2:] - inner[:, :-2])

    def response(self, direction: np.ndarray) -> np.ndarray:
        """Central differences along +v of the colours' projection on a unit direction, (K, 2 reach + 1)."""
        cut = self.side - 1
        mixed = self.colors[:, cut : self.colors.shape[1] - cut].astype(np.float32) @ (0.5 * direction)
        return mixed[:, 2:] - mixed[:, :-2]

    def admissible(self, expected: Expected, colors: SurfaceColors) -> np.ndarray:
        """Places whose two sides look as expected and are not hidden, bool (K, 2 reach + 1)."""
        far = 2 * self.side
        allowed = ~(self.hidden[:, :-far] | self.hidden[:, far:] | self.hidden[:, self.side : -self.side])
        if not expected.kind or expected.side == 0 or colors.board is None:
            return allowed
        labels = colors.label(self.colors)
        before, behind = labels[:, :-far], labels[:, far:]
        surface, other = (behind, before) if expected.side > 0 else (before, behind)
        if expected.kind == "paint":
            return allowed & (surface == BOARD) & (other == PAINT) if colors.paint_distinct else allowed
        same = other == surface
        if self.off is not None:
            before_off, behind_off = self.off[:, :-far], self.off[:, far:]
            surface_off, other_off = (behind_off, before_off) if expected.side > 0 else (before_off, behind_off)
            # joints of a wall may have the board's colour, but not its depth; lines on the board have both
            allowed = allowed & ~surface_off
            same &= other_off
        return np.asarray(allowed & (surface != 0) & ((other == 0) | same))

    def strength(self) -> np.ndarray:
        """Size of the colour gradient along v, whatever its direction, (K, 2 reach + 1)."""
        gradient = self.gradient()
        return np.sqrt(np.einsum("kmi,kmi->km", gradient, gradient))

    def peaks(self, response: np.ndarray, threshold: float) -> tuple[np.ndarray, np.ndarray]:
        """Sub-pixel row of the strongest answer of every profile and whether it is strong enough, (K,), (K,).

        The interpolation is that of a Gaussian peak: a blurred step has a Gaussian derivative, on which a parabola
        would be off by up to 0.03 px.
        """
        reach = self.reach
        offset = np.arange(-reach, reach + 1)
        preference = np.exp(-0.5 * (offset / max(_PREFERENCE * reach, 1.0)) ** 2)
        index = np.argmax(response * preference, axis=1)
        inner = np.minimum(np.maximum(index, 1), 2 * reach - 1)
        k = np.arange(len(index))
        peak = response[k, inner]
        good = (index == inner) & (peak > threshold)
        floor = np.maximum(_FLOOR * peak, 1e-6)
        before, middle, behind = (np.log(np.maximum(response[k, inner + step], floor)) for step in (-1, 0, 1))
        curvature = before - 2.0 * middle + behind
        shift = np.where(curvature < -1e-6, 0.5 * (before - behind) / np.minimum(curvature, -1e-6), 0.0)
        return self.base + offset[inner] + np.minimum(np.maximum(shift, -0.7), 0.7), good

    def sides(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Colours before and behind given rows, each (K, 3)."""
        middle = self.reach + self.side
        index = np.round(rows).astype(np.intp) - self.base + middle
        k, last = np.arange(len(index)), self.colors.shape[1] - 1
        before = np.minimum(np.maximum(index - self.side, 0), last)
        behind = np.minimum(np.maximum(index + self.side, 0), last)
        return self.colors[k, before], self.colors[k, behind]
