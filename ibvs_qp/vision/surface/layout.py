"""Everything that depends only on picture size and camera: masks, coarse grids, seeds."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.picture.grid import CoarseGrid
from ibvs_qp.vision.picture.mask import brush_zone, vehicle_mask
from ibvs_qp.vision.surface.plane import SPARSER
from ibvs_qp.vision.surface.seeds import UP_LEFT, Seeds, seeds_ahead


class PictureLayout:
    """Masks and grids of one picture size and camera.

    Attributes:
        mask: Vehicle's mask, uint8 (H, W).
        excluded: Where no flow points may lie, at half resolution, uint8: half a window around the vehicle, too.
        grid: Coarse grid.
        sparse_grid: A still coarser one, on which the surface is followed.
        beside_brush: Flat places of the grid's samples around the brush, where fresh paint lies.
        ladder: Cells beside the place where the tip meets a surface, by its depth.
    """

    def __init__(
        self, frame: RgbdFrame, config: VisionConfig, vehicle: VehicleParams | None, inwards: tuple[int, int] = UP_LEFT
    ) -> None:
        """Draw the masks and lay the grids for pictures like this one."""
        shape, intrinsics = (frame.rgb.shape[0], frame.rgb.shape[1]), frame.intrinsics
        self._key = (shape, tuple(intrinsics))
        self.mask = zone = np.zeros(shape, np.uint8)
        if vehicle is not None:
            self.mask = vehicle_mask(vehicle, config.brush_width_m, config.mask, intrinsics, shape)
            zone = brush_zone(vehicle, config.brush_width_m, config.mask, intrinsics, shape)
        hidden = np.asarray(self.mask | zone, np.uint8)[: shape[0] // 2 * 2 : 2, : shape[1] // 2 * 2 : 2]
        # The arm stands still in the picture: no window of a followed point may show its edge.
        window = cv2.getStructuringElement(cv2.MORPH_RECT, (config.flow.window_px, config.flow.window_px))
        self.excluded = np.asarray(cv2.dilate(hidden, window), np.uint8)
        columns = config.plane.grid_columns
        self.grid = CoarseGrid(shape, intrinsics, self.mask, columns)
        self.sparse_grid = CoarseGrid(shape, intrinsics, self.mask, columns // SPARSER)
        self.beside_brush = np.flatnonzero(self.grid.free & (self.grid.sample(zone) > 0))
        self.ladder: list[Seeds] = []
        if vehicle is not None:
            self.ladder = seeds_ahead(self.grid, vehicle, config.brush_width_m, inwards)

    def fits(self, frame: RgbdFrame) -> bool:
        """Whether a picture has this size and camera."""
        return self._key == ((frame.rgb.shape[0], frame.rgb.shape[1]), tuple(frame.intrinsics))
