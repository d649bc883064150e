"""The surface from picture to picture: followed on a sparser grid, searched anew when it is lost."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.appearance.light import on_surface
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.grid import Samples
from ibvs_qp.vision.surface.find import SurfaceFinder
from ibvs_qp.vision.surface.layout import PictureLayout
from ibvs_qp.vision.surface.plane import PlaneEstimate, refit_plane
from ibvs_qp.vision.surface.region import SurfaceRegion
from ibvs_qp.vision.surface.seeds import facing


class SurfaceTracker:
    """Plane and region of one camera's surface.

    Args:
        config: Settings of the plane.
        colors: Colours of board and paint; learned at every search for lines.

    Attributes:
        plane: In the last picture, None if it is unknown.
        region: At the last search, None before the first.
    """

    def __init__(self, config: PlaneConfig, colors: SurfaceColors) -> None:
        self._config, self._colors, self._finder = config, colors, SurfaceFinder(config, colors)
        self.reset()

    def reset(self) -> None:
        """Start again as new."""
        self._finder.reset()
        self.plane: PlaneEstimate | None = None
        self.region: SurfaceRegion | None = None

    def lose(self) -> None:
        """The next picture searches the surface."""
        self.plane = None

    def update(
        self,
        frame: RgbdFrame,
        layout: PictureLayout,
        predicted: np.ndarray | None,
        down: np.ndarray | None,
        seed_pixel: tuple[float, float] | None,
    ) -> str | None:
        """Follow the surface or search it; returns the reason when it is missing.

        Args:
            frame: Colour and depth.
            layout: Grid and seeds of the picture.
            predicted: Inverse depth of the followed plane in this picture, (3,); None where none is followed.
            down: Gravity's direction in C, unit, (3,), or None if unknown.
            seed_pixel: (u, v) of a place on the surface [px], for a search; None for the places beside the brush.
        """
        self.plane = None if predicted is None else self._followed(frame, layout, predicted, down)
        if self.plane is not None:
            return None
        if seed_pixel is None:
            seeds = facing(layout.grid, frame.depth, layout.ladder, self._config)
        else:
            (u, v), (height, width) = seed_pixel, frame.depth.shape
            if not (0 <= u < width and 0 <= v < height):
                return f"seed pixel ({u:g}, {v:g}) lies outside the picture of {width} x {height} px"
            row, column, _ = layout.grid.cells_at(u, v)
            seeds = [(int(row), int(column))]
        found = self._finder.find(frame, layout.grid, seeds, down, bare=seed_pixel is None)
        if isinstance(found, str):
            return found
        self.plane, self.region = found.plane, found
        return None

    def _followed(
        self, frame: RgbdFrame, layout: PictureLayout, predicted: np.ndarray, down: np.ndarray | None
    ) -> PlaneEstimate | None:
        """The surface refitted around its prediction on few samples; None if too little of it is left."""
        before, grid, config, colors = self.plane, layout.sparse_grid, self._config, self._colors
        if before is None:
            return None
        inverse = grid.mean_inverse_depth(frame.depth, config)
        labels = None if colors.board is None else colors.label(grid.sample(frame.rgb), *grid.pixels)
        found = refit_plane(grid, inverse, labels, predicted, down, config, sigma=before.residual_sigma)
        least = config.lost_share * before.component.mean()
        return found if isinstance(found, PlaneEstimate) and found.component.mean() >= least else None

    def region_now(self, frame: RgbdFrame, layout: PictureLayout, down: np.ndarray | None) -> SurfaceRegion:
        """The surface on the full coarse grid, for a search of lines; colours and light are learned on it."""
        assert self.plane is not None and self.region is not None  # every plane began with a region
        samples = layout.grid.read(frame, self._config)
        plane = self._whole(self.plane, samples, down)
        self._colors.learn(samples.colors, plane.component)
        if self._light_is_uneven(plane, frame, layout, samples):  # then all of the surface, not its well-lit part alone
            plane = self._refit(plane, samples, down) or plane
        if self.region.plane is not plane:
            self.region = self._finder.follow(samples, plane, self.region)
        return self.region

    def _whole(self, plane: PlaneEstimate, samples: Samples, down: np.ndarray | None) -> PlaneEstimate:
        """The plane on the full coarse grid; it is followed on a sparser one."""
        rows, columns = samples.grid.shape
        if plane.component.shape == (rows, columns):
            return plane
        if (refit := self._refit(plane, samples, down)) is not None:
            return refit
        component = cv2.resize(plane.component.view(np.uint8), (columns, rows), interpolation=cv2.INTER_NEAREST)
        return dataclasses.replace(plane, component=component.astype(bool))

    def _light_is_uneven(self, plane: PlaneEstimate, frame: RgbdFrame, layout: PictureLayout, samples: Samples) -> bool:
        """Learn how light falls on the surface, and how bright the paint is in it; whether the light is uneven."""
        grid, colors, shape = samples.grid, self._colors, (frame.rgb.shape[0], frame.rgb.shape[1])
        near, beside_brush = (
            on_surface(grid, frame.depth, plane.inverse_depth, self._config.fine_gate_high, places)
            for places in (grid.spread, layout.beside_brush)
        )
        tints, places = samples.colors.reshape(-1, 3).take(near, axis=0), grid.design[:, :2].take(near, axis=0)
        uneven = colors.learn_light(tints, places, shape, frame.intrinsics)
        colors.learn_paint(grid, samples.colors, beside_brush)
        return uneven

    def _refit(self, plane: PlaneEstimate, samples: Samples, down: np.ndarray | None) -> PlaneEstimate | None:
        """The plane fitted to the samples of the board's colour in the light that falls on them."""
        labels = self._finder.labels(samples)
        found = refit_plane(samples.grid, samples.inverse, labels, plane.inverse_depth, down, self._config)
        return found if isinstance(found, PlaneEstimate) else None
