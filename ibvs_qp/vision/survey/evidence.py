"""What depth and colour say beside lines, all lines at once: where the surface is seen, and where it is not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.surface import PlaneEstimate

#: Places looked at along a line.
_PLACES = 32
#: Distances from the line at which depth is read [px at 640]. A depth camera moves a step by up to 20 px.
DEPTH_PX = (3.0, 5.0, 8.0, 12.0, 18.0, 26.0, 36.0)
#: Distances at which colour is read [px at 640]: beyond blur, then farther.
COLOR_PX = (4.0, 7.0, 11.0)
#: A reading within this share of depth is on the surface at least and at most; three sigmas of the fit between.
_GATE_LOW, _GATE_HIGH, _GATE_SIGMAS = 0.010, 0.022, 3.0
#: What a depth reading says.
UNSEEN, ON, FARTHER, NEARER = 0, 1, 2, 3


@dataclass(frozen=True)
class SideEvidence:
    """One side of n lines, at K places along each.

    Attributes:
        depth: UNSEEN, ON, FARTHER or NEARER at growing distances, uint8 (n, D, K).
        colors: RGB at growing distances, float32 (n, C, K, 3).
        inside: Whether these colours lie in the picture, bool (n, C, K).
    """

    depth: np.ndarray
    colors: np.ndarray
    inside: np.ndarray

    @property
    def surface_share(self) -> np.ndarray:
        """Share of the places beside which the surface is seen within the distances that a step is moved by, (n,)."""
        return (self.depth[:, :5] == ON).any(axis=1).mean(axis=1)

    @property
    def end_share(self) -> np.ndarray:
        """Share of the places beside which the surface ends towards something farther, not behind something nearer."""
        ended = ~(self.depth[:, -2:] == ON).any(axis=1)
        covered = (self.depth[:, 2:] == NEARER).any(axis=1)
        farther = (self.depth == FARTHER).any(axis=1)
        return (ended & ~covered & farther).mean(axis=1)

    @property
    def covered_share(self) -> np.ndarray:
        """Share of the places beside which something nearer is seen, (n,)."""
        return (self.depth == NEARER).any(axis=1).mean(axis=1)


def side_evidence(
    pixels: np.ndarray, normals: np.ndarray, picture: Picture, depth: np.ndarray, plane: PlaneEstimate
) -> SideEvidence:
    """Read depth and colour on one side of lines.

    Args:
        pixels: End points of the lines [px], (n, 2, 2).
        normals: Unit vectors across them towards the side looked at [px], (n, 2).
        picture: Colour and camera.
        depth: Depth [m], (H, W).
        plane: The surface.
    """
    share = ((np.arange(_PLACES) + 0.5) / _PLACES)[:, None]
    places = pixels[:, :1] + share * (pixels[:, 1:] - pixels[:, :1])
    u, v, inside = _pixels(places, normals, DEPTH_PX, picture)
    fx, fy, cx, cy = picture.intrinsics
    a, b, c = plane.inverse_depth
    z = np.where(inside, depth[v, u], 0.0)
    with np.errstate(invalid="ignore"):
        relative = z * (a * (u - cx) / fx + b * (v - cy) / fy + c) - 1.0
        state = np.where(np.abs(relative) <= depth_gate(plane), ON, np.where(relative > 0.0, FARTHER, NEARER))
        state = np.where((z > 0.0) & np.isfinite(z), state, UNSEEN).astype(np.uint8)
    u, v, inside = _pixels(places, normals, COLOR_PX, picture)
    return SideEvidence(state, picture.rgb[v, u].astype(np.float32), inside)


def depth_gate(plane: PlaneEstimate) -> float:
    """Share of depth within which a reading is on the surface."""
    return min(max(_GATE_SIGMAS * plane.residual_sigma, _GATE_LOW), _GATE_HIGH)


def _pixels(
    places: np.ndarray, normals: np.ndarray, distances: tuple[float, ...], picture: Picture
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns, rows and whether they lie in the picture, of places (n, K, 2) at D distances, (n, D, K) each."""
    height, width = picture.mask.shape
    steps = picture.scale * np.array(distances)[:, None, None] * normals[:, None, None, :]
    at = np.rint(places[:, None] + steps).astype(np.intp)
    u, v = at[..., 0], at[..., 1]
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    return np.minimum(np.maximum(u, 0), width - 1), np.minimum(np.maximum(v, 0), height - 1), inside
