"""Strips of colour across predicted lines, all lines at once: where each profile has its edge, below a pixel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np

from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.query import LineView

#: Distance from the edge at which its two sides are looked at [px at 640]: beyond blur, within a 10 mm margin.
SIDE_PX = 4.0
#: Width of the preference for the predicted place, share of the strip.
_PREFERENCE = 0.6
#: A neighbour's gradient counts at least this share of the peak, so that the logarithm stays tame.
_FLOOR = 0.05
#: Rows around the middle that must be seen for a profile to count as visible.
_MIDDLE = (-2, 0, 2)


@dataclass
class Strips:
    """Colour around L predicted level lines v = v(u): K profiles, each one column of M pixels, of every line.

    Attributes:
        picture: Where they were read.
        views: The lines, each level in its own view, (L).
        u: Columns of the profiles, (L, K).
        predicted: Predicted rows at these columns [px], (L, K).
        base: The same in whole pixels, (L, K).
        colors: RGB of the pixels, uint8 (L, K, M, 3).
        hidden: Non-zero where the vehicle hides a pixel or where it lies outside the picture, uint8 (L, K, M).
        reach: Rows searched on either side of the prediction.
        side: Distance of the two sides from the edge [px].
    """

    picture: Picture
    views: list[LineView]
    u: np.ndarray
    predicted: np.ndarray
    base: np.ndarray
    colors: np.ndarray
    hidden: np.ndarray
    reach: int
    side: int

    @classmethod
    def gather(cls, picture: Picture, views: list[LineView], config: LineConfig, reach: int) -> Strips:
        """Read the pixels within `reach` rows of every line."""
        spans = [view.last - view.first for view in views]
        profiles, side = profile_count(views, config), side_px(picture)
        far = reach + side
        table = np.array(
            [
                (view.first + 0.5, span, *view.slope_level, view.view.height + 2.0 * far, *_CODES[view.upright])
                for view, span in zip(views, spans, strict=True)
            ]
        )
        first, span, slope, level, lowest, u_code, v_code = table.T[:, :, None]
        u = np.floor(first + span * _shares(profiles))
        predicted = slope * u + level
        base = np.minimum(np.maximum(np.rint(predicted), -2.0 * far), lowest)
        # one call reads the strips of level and upright lines alike, places outside the picture included; both
        # coordinates are counted up in one number
        places = np.empty((len(views), profiles, 2 * far + 1), np.int32)
        middles = (u_code * u + v_code * base).astype(np.int32)
        steps = np.arange(-far, far + 1, dtype=np.int32)
        for place, middle, view in zip(places, middles, views, strict=True):
            np.add(middle[:, None], steps if view.upright else steps * _ROW, out=place)
        shape = places.shape
        pairs = places.view(np.int16).reshape(-1, shape[2], 2)
        colors = cv2.remap(picture.rgb, pairs, _WHOLE, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
        hidden = cv2.remap(
            picture.mask, pairs, _WHOLE, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=255.0
        )
        colors, hidden = colors.reshape(*shape, 3), hidden.reshape(shape)
        return cls(picture, views, u, predicted, base, colors, hidden, reach, side)

    @cached_property
    def visible(self) -> np.ndarray:
        """Profiles whose middle is neither hidden nor outside, bool (L, K)."""
        middle = self.reach + self.side
        one, two, three = (self.hidden[:, :, middle + step] for step in _MIDDLE)
        return (one | two | three) == 0

    @property
    def expected(self) -> np.ndarray:
        """Profiles within the part of each line that is known, bool (L, K)."""
        first, last = np.array([view.extent for view in self.views]).T[:, :, None]
        return (self.u >= first) & (self.u <= last)

    def gradient(self, rows: np.ndarray) -> np.ndarray:
        """Central differences of the channels along +v [grey levels per px] of profiles (n,), (n, 2 reach + 1, 3)."""
        cut = self.side - 1
        inner = self.flat_colors.take(rows, axis=0)[:, cut : self.colors.shape[2] - cut].astype(np.float32)
        return 0.5 * (inner[:, 2:] - inner[:, :-2])

    def response(self, directions: np.ndarray) -> np.ndarray:
        """Central differences along +v of the colours' projection on unit directions (L, 3), (L, K, 2 reach + 1)."""
        cut, (count, profiles, pixels, _) = self.side - 1, self.colors.shape
        flat = self.colors.reshape(count, -1, 3).astype(np.float32)
        mixed = (flat @ (0.5 * directions[:, :, None])).reshape(count, profiles, pixels)[:, :, cut : pixels - cut]
        return mixed[:, :, 2:] - mixed[:, :, :-2]

    @property
    def flat_colors(self) -> np.ndarray:
        """Colours of all profiles, uint8 (L K, M, 3)."""
        return self.colors.reshape(-1, *self.colors.shape[2:])

    def strongest(self, response: np.ndarray) -> np.ndarray:
        """Index of the strongest answer along the last axis, with a preference for the predicted place."""
        return (response * _preference(self.reach)).argmax(axis=-1)

    def peaks(self, response: np.ndarray, index: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sub-pixel peaks of answers (n, 2 reach + 1) near whole places (n,).

        The interpolation is that of a Gaussian peak: a blurred step has a Gaussian derivative, on which a parabola
        would be off by up to 0.03 px.

        Returns:
            Place from the predicted row [px], (n,), the answer there, (n,), and whether a peak could be there: not at
            the border of the strip, (n,).
        """
        size = response.shape[-1]
        inner = np.minimum(np.maximum(index, 1), size - 2)
        place = inner + np.arange(0, inner.size * size, size)
        around = response.take(place + _NEIGHBOURS)
        peak = around[1]
        share = around[::2] / np.maximum(peak, np.float32(1e-6))
        before, behind = np.log(np.maximum(share, np.float32(_FLOOR)))
        curvature = np.minimum(before + behind, np.float32(-1e-6))
        shift = (before - behind) * np.float32(0.5) / curvature
        np.minimum(np.maximum(shift, np.float32(-0.7), out=shift), np.float32(0.7), out=shift)
        shift *= curvature < -2e-6  # flat, or no peak at all: nothing to interpolate
        return (inner - self.reach) + shift, peak, index == inner

    def sides(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Colours before and behind given rows (L, K), each uint8 (L, K, 3)."""
        pixels = self.colors.shape[2]
        index = np.rint(rows - self.base).astype(np.intp)
        index = np.minimum(np.maximum(index, -self.reach), self.reach)
        index += np.arange(self.reach + self.side, rows.size * pixels, pixels).reshape(rows.shape)
        flat = self.colors.reshape(-1, 3)
        return flat.take(index - self.side, axis=0), flat.take(index + self.side, axis=0)


def profile_count(views: list[LineView], config: LineConfig) -> int:
    """Profiles along each of the lines: no column twice."""
    return min(config.profiles, int(min(view.last - view.first for view in views)) + 1)


def side_px(picture: Picture) -> int:
    """Distance from an edge at which its two sides are looked at, whole [px]."""
    return max(2, round(SIDE_PX * picture.scale))


@lru_cache(maxsize=16)
def _shares(profiles: int) -> np.ndarray:
    """Places of the profiles along a line, 0 to 1, (profiles,)."""
    return np.arange(profiles) * (1.0 / (profiles - 1))


@lru_cache(maxsize=16)
def _preference(reach: int) -> np.ndarray:
    """Weight of every place of a strip: the predicted one in the middle counts most, float32 (2 reach + 1,)."""
    offset = np.arange(-reach, reach + 1)
    return np.exp(-0.5 * (offset / max(_PREFERENCE * reach, 1.0)) ** 2).astype(np.float32)


#: A step down in places counted as x + _ROW y, which in memory are pairs of 16 bits; left of the picture y is off by
#: one, where nothing is seen anyway. What columns and rows of the view count, level and upright.
_ROW = 1 << 16
_CODES = ((1.0, float(_ROW)), (float(_ROW), 1.0))
#: Whole pixels need no table of fractions.
_WHOLE = np.empty((0, 0), np.uint16)
#: A place and those beside it.
_NEIGHBOURS = np.array([-1, 0, 1])[:, None]
