"""The vehicle's mask follows the geometry and covers what the rendered camera draws of the vehicle."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.vision.config import MaskConfig
from ibvs_qp.vision.picture.layout import vehicle_mask
from sim.sensors.cameras.arm import vehicle_layer
from sim.sensors.cameras.protocol import camera_intrinsics
from sim.world.scene import Scene


def mask_of(vehicle: VehicleParams, brush: float = 0.08, shape: tuple[int, int] = (480, 640)) -> np.ndarray:
    focal = 625.2 * shape[0] / 480
    intrinsics = (focal, focal, 0.5 * (shape[1] - 1), 0.5 * (shape[0] - 1))
    return vehicle_mask(vehicle, brush, MaskConfig(), intrinsics, shape) > 0


@pytest.mark.parametrize("brush", [0.05, 0.08, 0.12])
@pytest.mark.parametrize("size", [(640, 480), (424, 240)])
def test_covers_the_rendered_vehicle_and_little_more(brush: float, size: tuple[int, int]) -> None:
    scene = Scene()
    scene = dataclasses.replace(
        scene,
        camera=dataclasses.replace(scene.camera, width=size[0], height=size[1]),
        paint=dataclasses.replace(scene.paint, brush_width_m=brush),
    )
    intrinsics = camera_intrinsics(scene.camera)
    layer = vehicle_layer(scene, VehicleParams(), intrinsics, np.random.default_rng(0))
    ours = vehicle_mask(VehicleParams(), brush, MaskConfig(), intrinsics, (size[1], size[0])) > 0
    drawn = (layer.mask | layer.propellers) > 0
    assert not (drawn & ~ours).any()
    assert (ours & ~drawn).mean() < 0.03


def test_guide_of_row_1_stays_visible_below_the_brush() -> None:
    mask = mask_of(VehicleParams())
    assert mask[140, 320] and mask[100, 320]
    assert not mask[199:].any()
    assert not mask[:, 0:100][150:].any()


def test_propellers_follow_the_geometry() -> None:
    nominal = mask_of(VehicleParams())
    longer = mask_of(VehicleParams(propeller_radius_m=0.30))
    assert not nominal[:40, :60].any()  # just outside the corners
    assert longer[:40, :60].any() and longer[:40, -60:].any()


def test_brush_width_and_tip_move_the_mask() -> None:
    assert mask_of(VehicleParams(), 0.12).sum() > mask_of(VehicleParams(), 0.08).sum()
    lower = mask_of(VehicleParams(tip_position_m=(0.70, 0.0, 0.05)))
    assert lower[195:210].any()


@pytest.mark.parametrize("shape", [(720, 1280), (1081, 1921)])
def test_a_large_picture_hides_what_a_small_one_does_and_a_cell_more(shape: tuple[int, int]) -> None:
    """Masks of wide pictures are grown in cells of 2 to 4 pixels."""
    large, cell = mask_of(VehicleParams(), shape=shape), -(-shape[1] // 640)
    shrunk = mask_of(VehicleParams(), shape=(shape[0] // cell, shape[1] // cell))
    sampled = large[cell // 2 :: cell, cell // 2 :: cell][: shrunk.shape[0], : shrunk.shape[1]]
    assert (shrunk & ~sampled).mean() < 0.003
    assert (sampled & ~shrunk).mean() < 0.01
