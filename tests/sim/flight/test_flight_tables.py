"""What a flight is drawn from and written to: noise in blocks, a table in blocks, truth for all ticks at once."""

from __future__ import annotations

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from sim.flight import columns
from sim.flight.assemble import euler_angles, in_body, rotations
from sim.world.board import BoardGeometry
from sim.world.clearance import PropellerClearance
from sim.world.plant import Plant
from sim.world.random_streams import BLOCK, Normals, stream
from sim.world.scene import BoardScene, Scene, StartScene


def test_noise_in_blocks_is_the_noise_drawn_one_by_one() -> None:
    normals, plain = Normals(stream(3, "gyro")), stream(3, "gyro")
    sizes = [3, 1, 6, BLOCK + 5, 2] * 60
    for size in sizes:
        np.testing.assert_array_equal(normals.take(size), plain.standard_normal(size))


def test_rows_come_back_in_order() -> None:
    table = columns.Columns({"one": 1, "three": 3})
    assert table.arrays()["one"].shape == (0,) and table.arrays()["three"].shape == (0, 3)
    for k in range(20):
        table.add(np.array((k, 10.0 * k)), np.array((20.0 * k, 30.0 * k)))
    arrays = table.arrays()
    np.testing.assert_array_equal(arrays["one"], np.arange(20))
    np.testing.assert_array_equal(arrays["three"], np.outer(np.arange(20), (10, 20, 30)))
    assert len(table) == 20


def test_truth_of_the_log_is_what_the_plant_tells() -> None:
    scene = Scene(board=BoardScene(slope_deg=4.0, gap_m=0.08), start=StartScene(distance_m=1.0, yaw_deg=5.0))
    plant, rng = Plant(scene, seed=2), np.random.default_rng(0)
    motion, told = [], []
    for _ in range(80):
        plant.step(plant.thrusts_actual + rng.normal(size=6))
        motion.append(plant.motion)
        told.append(np.concatenate((plant.euler, plant.velocity, [plant.propeller_clearance])))
    logged, told = np.array(motion), np.array(told)
    rotation = rotations(logged[:, 6:10])
    np.testing.assert_allclose(euler_angles(rotation), told[:, :3], atol=1e-12)
    np.testing.assert_allclose(in_body(rotation, logged[:, 3:6]), told[:, 3:6], atol=1e-12)
    clearance = PropellerClearance(BoardGeometry(scene), VehicleParams())
    np.testing.assert_allclose(clearance.distances(logged[:, :3], rotation), told[:, 6], atol=1e-12)
