"""Errors of body and mount drawn by the seed: their stated size, their spread, and none at size zero."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from sim.world.errors import BodyErrors, CameraErrors, WorldErrors
from sim.world.plant_scene import PlantScene
from sim.world.scene import Scene
from sim.world.true_vehicle import TrueVehicle, true_vehicle

BELIEVED = VehicleParams()
SEEDS = 400


def drawn(
    plant: PlantScene | None = None, seeds: int = SEEDS, **errors: BodyErrors | CameraErrors
) -> list[TrueVehicle]:
    scene = Scene(plant=plant or PlantScene(), errors=WorldErrors(**errors))  # type: ignore[arg-type]
    return [true_vehicle(scene, BELIEVED, seed) for seed in range(seeds)]


def test_mass_inertia_and_tip_are_off_by_the_stated_amount() -> None:
    body = BodyErrors(mass=0.05, inertia=-0.1, tip_m=(0.01, -0.02, 0.005))
    for true in drawn(PlantScene(inertia_products_kg_m2=(0.01, 0.0, 0.0)), seeds=3, body=body):
        assert true.mass_kg == pytest.approx(1.05 * BELIEVED.mass_kg)
        np.testing.assert_allclose(true.inertia_kg_m2, 0.9 * np.array(BELIEVED.inertia_kg_m2))
        np.testing.assert_allclose(true.inertia_products_kg_m2, [0.009, 0.0, 0.0])
        np.testing.assert_allclose(true.tip_position_m, [0.71, -0.02, 0.005])


def test_the_centre_of_mass_moves_by_its_size_with_random_signs() -> None:
    size = np.array([0.02, 0.01, 0.03])
    offsets = np.array([true.com_offset_m for true in drawn(body=BodyErrors(com_m=(0.02, 0.01, 0.03)))])
    np.testing.assert_allclose(np.abs(offsets), np.tile(size, (SEEDS, 1)))
    assert len(np.unique(np.sign(offsets), axis=0)) == 8
    # The mean of N random signs has the standard deviation 1 / sqrt(N).
    assert np.abs(np.mean(offsets / size, axis=0)).max() < 4.0 / np.sqrt(SEEDS)


def test_the_mount_moves_and_turns_by_its_size_in_random_directions() -> None:
    found = drawn(camera=CameraErrors(mount_m=0.01, mount_deg=1.5))
    shifts = np.array([true.camera_position_m for true in found]) - BELIEVED.camera_position_m
    turns = np.array([true.camera_turn_deg for true in found])
    for vectors, size in ((shifts, 0.01), (turns, 1.5)):
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), size)
        # Every component of a random unit vector has mean 0 and mean square 1/3.
        assert np.abs(vectors.mean(axis=0)).max() < 4.0 * size / np.sqrt(3.0 * SEEDS)
        np.testing.assert_allclose((vectors**2).mean(axis=0), size**2 / 3.0, rtol=0.2)
    assert abs(np.corrcoef(shifts[:, 0], turns[:, 0])[0, 1]) < 4.0 / np.sqrt(SEEDS), "independent draws"


def test_the_focal_length_is_off_by_its_standard_deviation() -> None:
    ratios = np.array([true.focal_ratio for true in drawn(camera=CameraErrors(focal=0.02))])
    assert np.std(ratios) == pytest.approx(0.02, rel=0.15)
    assert np.mean(ratios) == pytest.approx(1.0, abs=4.0 * 0.02 / np.sqrt(SEEDS))


def test_errors_add_to_what_the_plant_states_and_leave_the_rest() -> None:
    plant = PlantScene(mass_kg=7.0, com_offset_m=(0.03, 0.0, 0.0))
    (true,) = drawn(plant, seeds=1, body=BodyErrors(mass=0.1, com_m=(0.01, 0.0, 0.0)))
    assert true.mass_kg == pytest.approx(7.7) and abs(true.com_offset_m[0] - 0.03) == pytest.approx(0.01)
    assert true.camera_position_m == BELIEVED.camera_position_m and true.geometry == BELIEVED.geometry
    (one,), (two,) = (drawn(seeds=1, body=BodyErrors(com_m=(size, 0.0, 0.0))) for size in (0.01, 0.02))
    assert two.com_offset_m[0] == 2.0 * one.com_offset_m[0], "the seed draws the sign, the scene the size"
