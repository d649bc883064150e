"""Strips of colour across predicted lines, all lines at once: where each profile has its edge, below a pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.colors import BOARD, PAINT, SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.query import LineView

#: Distance from the edge at which its two sides are looked at [px at 640]: beyond blur, within a 10 mm margin.
SIDE_PX = 4.0
#: Width of the preference for the predicted place, share of the strip.
_PREFERENCE = 0.6
#: A reading farther from the surface than this share of depth is not on it (2.6 sigma of 0.5 % + 0.5 % noise).
_OFF_PLANE = 0.018
#: A neighbour's gradient counts at least this share of the peak, so that the logarithm stays tame.
_FLOOR = 0.05


@dataclass
class Strips:
    """Colour around L predicted level lines v = v(u): K profiles, each one column of M pixels, of every line.

    Attributes:
        views: The lines, each level in its own view, (L).
        u: Columns of the profiles, (L, K).
        base: Predicted rows at these columns, (L, K).
        colors: RGB of the pixels, uint8 (L, K, M, 3).
        hidden: Pixels that the vehicle hides or that lie outside the picture, bool (L, K, M).
        reach: Rows searched on either side of the prediction.
        side: Distance of the two sides from the edge [px].
        off: Pixels whose depth is not the surface's, bool (L, K, M), looked up for lines of kind "board"; or None.
    """

    views: list[LineView]
    u: np.ndarray
    base: np.ndarray
    colors: np.ndarray
    hidden: np.ndarray
    reach: int
    side: int
    off: np.ndarray | None

    @classmethod
    def gather(cls, picture: Picture, views: list[LineView], config: LineConfig, reach: int) -> Strips:
        """Read the pixels within `reach` rows of every line."""
        first = np.array([view.first for view in views])
        length = np.array([view.last for view in views]) - first
        profiles = min(config.profiles, int(length.min()) + 1)  # no column twice
        side = max(2, round(SIDE_PX * picture.scale))
        u = np.floor(first[:, None] + length[:, None] * np.linspace(0.0, 1.0, profiles) + 0.5).astype(np.intp)
        p, q, r = np.array([view.coefficients for view in views]).T[:, :, None]
        base = np.round(-(p * u + r) / q).astype(np.intp)
        rows = base[:, :, None] + np.arange(-reach - side, reach + side + 1)
        last_row = np.array([view.view.height - 1 for view in views])[:, None]
        crossing = bool(((base < reach + side) | (base > last_row - reach - side)).any())
        inside = np.minimum(np.maximum(rows, 0), last_row[:, :, None]) if crossing else rows
        row_step, column_step = np.array([(view.view.row_step, view.view.column_step) for view in views]).T[:, :, None]
        place = inside * row_step[:, :, None] + (u * column_step)[:, :, None]
        hidden = picture.hidden.take(place) != 0
        if crossing:
            hidden |= inside != rows
        off = _off_surface(picture, views, u, inside, place)
        return cls(views, u, base, picture.colors.take(place, axis=0), hidden, reach, side, off)

    @property
    def visible(self) -> np.ndarray:
        """Profiles whose middle is neither hidden nor outside, bool (L, K)."""
        middle = self.reach + self.side
        return np.logical_not(self.hidden[:, :, middle - 2 : middle + 3].any(axis=2))

    def gradient(self, chosen: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Central differences of the channels along +v [grey levels per px], (L, K, 2 reach + 1, 3) or (n, ...)."""
        cut = self.side - 1
        inner = self.colors[chosen][..., cut : self.colors.shape[2] - cut, :].astype(np.float32)
        return 0.5 * (inner[..., 2:, :] - inner[..., :-2, :])

    def response(self, directions: np.ndarray) -> np.ndarray:
        """Central differences along +v of the colours' projection on unit directions (L, 3), (L, K, 2 reach + 1)."""
        cut, (count, profiles, pixels, _) = self.side - 1, self.colors.shape
        flat = self.colors.reshape(count, -1, 3).astype(np.float32)
        mixed = (flat @ (0.5 * directions[:, :, None])).reshape(count, profiles, pixels)[:, :, cut : pixels - cut]
        return mixed[:, :, 2:] - mixed[:, :, :-2]

    def admissible(self, colors: SurfaceColors) -> np.ndarray:
        """Places whose two sides look as expected and are not hidden, bool (L, K, 2 reach + 1)."""
        far = 2 * self.side
        allowed = ~(self.hidden[:, :, :-far] | self.hidden[:, :, far:] | self.hidden[:, :, self.side : -self.side])
        known = [k for k, view in enumerate(self.views) if view.query.kind and view.side != 0]
        if not known or colors.board is None:
            return allowed
        labels = colors.label(self.colors if len(known) == len(self.views) else self.colors[known])
        for k, label in zip(known, labels, strict=True):
            view, before, behind = self.views[k], label[:, :-far], label[:, far:]
            surface, other = (behind, before) if view.side > 0 else (before, behind)
            if view.query.kind == "paint":
                if colors.paint_distinct:
                    allowed[k] &= (surface == BOARD) & (other == PAINT)
                continue
            same = other == surface
            if self.off is not None:
                before_off, behind_off = self.off[k, :, :-far], self.off[k, :, far:]
                surface_off, other_off = (behind_off, before_off) if view.side > 0 else (before_off, behind_off)
                # joints of a wall may have the board's colour, but not its depth; lines on the board have both
                allowed[k] &= ~surface_off
                same &= other_off
            allowed[k] &= (surface != 0) & ((other == 0) | same)
        return allowed

    def strength(self, chosen: np.ndarray) -> np.ndarray:
        """Size of the colour gradient along v of chosen profiles (bool (L, K)), whatever its direction, (n, ...)."""
        gradient = self.gradient(chosen)
        return np.sqrt(np.vecdot(gradient, gradient))

    def peaks(self, response: np.ndarray, threshold: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sub-pixel row of the strongest answer of every profile and whether it is strong enough, (L, K) each.

        The interpolation is that of a Gaussian peak: a blurred step has a Gaussian derivative, on which a parabola
        would be off by up to 0.03 px.
        """
        reach, (_, profiles, size) = self.reach, response.shape
        offset = np.arange(-reach, reach + 1)
        preference = np.exp(-0.5 * (offset / max(_PREFERENCE * reach, 1.0)) ** 2).astype(np.float32)
        index = np.argmax(response * preference, axis=2)
        inner = np.minimum(np.maximum(index, 1), 2 * reach - 1)
        place = np.arange(index.size).reshape(-1, profiles) * size + inner
        around = response.take(place + np.array([-1, 0, 1])[:, None, None])
        peak = around[1]
        good = (index == inner) & (peak > threshold[:, None])
        before, middle, behind = np.log(np.maximum(around, np.maximum(_FLOOR * peak, np.float32(1e-6))))
        curvature = np.minimum(before - 2.0 * middle + behind, np.float32(-1e-6))
        shift = 0.5 * (before - behind) / curvature
        shift[curvature > -2e-6] = 0.0  # flat: no peak to interpolate
        return self.base + offset.take(inner) + np.minimum(np.maximum(shift, -0.7), 0.7), good

    def sides(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Colours before and behind given rows (L, K), each uint8 (L, K, 3)."""
        last = self.colors.shape[2] - 1
        index = np.round(rows).astype(np.intp) - (self.base - (self.reach + self.side))
        start = np.arange(index.size).reshape(index.shape) * (last + 1)
        flat = self.colors.reshape(-1, 3)
        before = np.minimum(np.maximum(index - self.side, 0), last)
        behind = np.minimum(np.maximum(index + self.side, 0), last)
        return flat.take(start + before, axis=0), flat.take(start + behind, axis=0)


def _off_surface(
    picture: Picture, views: list[LineView], u: np.ndarray, rows: np.ndarray, place: np.ndarray
) -> np.ndarray | None:
    """Pixels whose depth is known not to be the surface's, for lines of kind "board"."""
    if picture.depth is None or picture.plane is None:
        return None
    off = np.zeros(place.shape, bool)
    for k, view in enumerate(views):
        if view.query.kind == "board" and view.view.plane is not None:
            a, b, c = view.view.plane
            fx, fy, cx, cy = view.view.intrinsics
            surface = rows[k] * (b / fy) + (u[k] * (a / fx) + (c - a * cx / fx - b * cy / fy))[:, None]
            relative = picture.depth.take(place[k]) * surface
            off[k] = (relative > 0.0) & (np.abs(relative - 1.0) > _OFF_PLANE)  # no reading: not known to be off
    return off
