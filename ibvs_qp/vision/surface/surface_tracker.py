"""The surface from picture to picture: followed on a coarser grid, searched anew when it is lost."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.appearance.light_samples import on_surface
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.surface.find_surface import find_surface, followed_region
from ibvs_qp.vision.surface.layout import PictureLayout
from ibvs_qp.vision.surface.plane import PlaneEstimate, PlaneFitter
from ibvs_qp.vision.surface.region import SurfaceRegion
from ibvs_qp.vision.surface.seeds import facing


class SurfaceTracker:
    """Plane and region of one camera's surface.

    Args:
        config: Settings of the plane.
        colors: What board and paint look like; learned at every search for lines.

    Attributes:
        plane: In the last picture, None if it is unknown.
        region: As the last search saw it, None before the first.
    """

    def __init__(self, config: PlaneConfig, colors: SurfaceColors) -> None:
        self._config, self._colors, self._fitter = config, colors, PlaneFitter(config)
        self.reset()

    def reset(self) -> None:
        """Forget everything seen."""
        self._fitter.reset()
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
        """Follow the surface or search it; returns the reason when there is none.

        Args:
            frame: Colour and depth.
            layout: Grid and seeds of the picture.
            predicted: Inverse depth of the followed plane in this picture, (3,); None where none is followed.
            down: Gravity's direction in C, unit, (3,), or None if unknown.
            seed_pixel: (u, v) of a place on the surface [px], for a search; None for the places beside the brush.
        """
        if self.plane is not None and predicted is not None:
            before = self.plane
            followed = layout.follower.follow(
                frame.rgb, frame.depth, predicted, before.residual_sigma, self._colors, down
            )
            least = self._config.lost_share * before.component.mean()
            if isinstance(followed, PlaneEstimate) and followed.component.mean() >= least:
                self.plane = followed
                return None
        self.plane = None
        seeds = facing(layout.grid, frame.depth, layout.ladder, self._config)
        if seed_pixel is not None:
            u, v = seed_pixel
            height, width = frame.depth.shape
            if not (0 <= u < width and 0 <= v < height):
                return f"seed pixel ({u:g}, {v:g}) lies outside the picture of {width} x {height} px"
            seeds = [layout.grid.cell_at(u, v)]
        found = find_surface(
            frame, layout.grid, self._fitter, self._config, seeds, self._colors, down, seed_pixel is None
        )
        if isinstance(found, str):
            return found
        self.plane, self.region = found.plane, found
        return None

    def region_now(self, frame: RgbdFrame, layout: PictureLayout, down: np.ndarray | None) -> SurfaceRegion:
        """The surface on the full coarse grid, for a search of lines; colours and light are learned on it."""
        assert self.plane is not None
        coarse, region = layout.grid.sample(frame.rgb), self.region
        plane = self._whole(self.plane, frame, layout, coarse, down)
        self._colors.learn(coarse, plane.component)
        plane = self._in_its_light(plane, frame, layout, coarse, down)
        assert region is not None  # every plane began with a region
        if region.plane is not plane:
            region = followed_region(frame, layout.grid, self._config, plane, self._colors, region)
        self.region = region
        return region

    def _whole(
        self,
        plane: PlaneEstimate,
        frame: RgbdFrame,
        layout: PictureLayout,
        coarse: np.ndarray,
        down: np.ndarray | None,
    ) -> PlaneEstimate:
        """The plane on the full coarse grid; it is followed on a coarser one."""
        if plane.component.shape == layout.grid.shape:
            return plane
        refit = self._refit(plane, frame, layout, coarse, down)
        if isinstance(refit, PlaneEstimate):
            return refit
        rows, columns = layout.grid.shape
        component = cv2.resize(plane.component.view(np.uint8), (columns, rows), interpolation=cv2.INTER_NEAREST)
        return dataclasses.replace(plane, component=component.astype(bool))

    def _in_its_light(
        self,
        plane: PlaneEstimate,
        frame: RgbdFrame,
        layout: PictureLayout,
        coarse: np.ndarray,
        down: np.ndarray | None,
    ) -> PlaneEstimate:
        """Learn how light falls on the surface; where it is uneven, all of the surface instead of its well-lit part."""
        grid, shape = layout.grid, (frame.rgb.shape[0], frame.rgb.shape[1])
        inverse, gate = plane.inverse_depth, self._config.fine_gate_high
        near = on_surface(grid, frame.depth, inverse, gate)
        uneven = False
        if not self._colors.surely_even(coarse, near):
            places = grid.design[:, :2].take(near, axis=0)
            samples = coarse.reshape(-1, 3).take(near, axis=0)
            uneven = self._colors.learn_light(samples, places, shape, frame.intrinsics)
        self._colors.learn_paint(grid, coarse, on_surface(grid, frame.depth, inverse, gate, layout.beside_brush))
        refit = self._refit(plane, frame, layout, coarse, down) if uneven else plane
        return refit if isinstance(refit, PlaneEstimate) else plane

    def _refit(
        self,
        plane: PlaneEstimate,
        frame: RgbdFrame,
        layout: PictureLayout,
        coarse: np.ndarray,
        down: np.ndarray | None,
    ) -> PlaneEstimate | str:
        """The plane fitted to the samples of the board's colour in the light that falls on them."""
        grid, colors, config = layout.grid, self._colors, self._config
        inverse = grid.inverse_depth(frame.depth, config.distance_min_m, config.distance_max_m)
        prefer = None if colors.board is None else colors.label(coarse, colors.levels_at(*grid.pixels))
        return self._fitter.track(grid, inverse, plane.inverse_depth, down, prefer)
