"""What ends a flight, and how near the propellers are to board and wall."""

import math

import numpy as np
import pytest
from controller_scenes import TICK_NS
from plants import at_rest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import rotation_from_quaternion
from sim.world.board import BoardGeometry
from sim.world.clearance import RIM_POINTS, PropellerClearance
from sim.world.plant import Plant
from sim.world.scene import BoardScene, Scene

VEHICLE = VehicleParams()


def test_propeller_strike_is_a_crash_before_board_and_wall():
    gap = Scene(board=BoardScene(gap_m=0.30))
    for y, crashes in ((1.0, True), (-3.0, False)):
        plant = at_rest(Plant(gap), np.array([-0.55, y, -1.5]))
        plant.step(plant.thrusts_actual)
        assert (plant.crashed == "propeller strike") == crashes
    plant = at_rest(Plant(gap), np.array([-0.29, -3.0, -1.5]))
    plant.step(plant.thrusts_actual)
    assert plant.crashed == "propeller strike"
    # In contact and level the propellers clear the board; yawed by 20 deg about the tip they strike.
    level = at_rest(Plant(Scene()), np.array([-0.70, 0.7, -1.5]))
    level.step(level.thrusts_actual)
    assert level.crashed is None and 0.08 < level.propeller_clearance < 0.12
    yaw = math.radians(20.0)
    arm = 0.70 * np.array([math.cos(yaw), math.sin(yaw), 0.0])
    turned = at_rest(Plant(Scene()), np.array([0.0, 0.7, -1.5]) - arm, (0.0, 0.0, yaw))
    turned.step(turned.thrusts_actual)
    assert turned.crashed == "propeller strike"


def test_clearance_against_dense_sampling_of_the_discs():
    scene = Scene(board=BoardScene(slope_deg=4.0, gap_m=0.08))
    board, rng = BoardGeometry(scene), np.random.default_rng(3)
    clearance = PropellerClearance(board, VEHICLE)
    angle, geometry = np.linspace(0.0, 2.0 * math.pi, 3600)[:, None], VEHICLE.geometry
    near_board, spacing = 0, math.pi * VEHICLE.propeller_radius_m / RIM_POINTS
    for _ in range(40):
        turn = rng.normal(size=4) * [0.0, 0.08, 0.08, 0.1] + [1.0, 0.0, 0.0, 0.0]
        rotation = rotation_from_quaternion(turn / np.linalg.norm(turn))
        position = np.array([-0.7, rng.uniform(-0.6, 2.0), rng.uniform(-2.2, -0.9)])
        inner = outer = math.inf  # with the outline as it is, and shrunk by what the coarse rim may miss
        for hub, axis in zip(geometry.positions, geometry.axes, strict=True):
            first = np.cross(axis, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(axis, [0.0, 0.0, 1.0]))
            rim = hub + VEHICLE.propeller_radius_m * (np.cos(angle) * first + np.sin(angle) * np.cross(axis, first))
            world = position + rim @ rotation.T
            along, up = board.board_coordinates(world[:, 1:]).T
            room = np.minimum.reduce((along, 1.4 - along, up, 0.6 - up))
            inner = min(inner, float((np.where(room > spacing, 0.0, 0.08) - world[:, 0]).min()))
            outer = min(outer, float((np.where(room > 0.0, 0.0, 0.08) - world[:, 0]).min()))
        found = clearance.distance(position, rotation)
        assert outer - 1e-4 <= found <= inner + spacing
        near_board += found < 0.08 - clearance.foremost(position, rotation) - 1e-6
    assert near_board > 5


@pytest.mark.parametrize(
    ("sink", "roll_deg", "end"),
    [(0.55, 0.0, "landed"), (0.3, 24.0, "landed"), (0.65, 0.0, "hit the ground"), (0.3, 26.0, "hit the ground")],
)
def test_a_slow_level_touchdown_is_a_landing_and_no_crash(sink, roll_deg, end):
    plant = at_rest(Plant(Scene()), np.array([-2.0, 0.0, -0.151]), (math.radians(roll_deg), 0.0, 0.0))
    plant.data.qvel[2] = -sink
    plant.step(plant.thrusts_actual)
    assert plant.over and plant.landed == (end == "landed") and plant.crashed == (None if plant.landed else end)


def test_ground_flip_and_bad_numbers_end_the_flight():
    plant = Plant(Scene())
    at_rest(plant, np.array([-1.5, 0.0, -0.3]))
    for _ in range(100):
        plant.step(np.full(6, 1.2))
    assert plant.crashed == "hit the ground"
    plant = at_rest(Plant(Scene()), np.array([-2.0, 0.0, -3.0]), (math.radians(70.0), 0.0, 0.0))
    plant.step(plant.thrusts_actual)
    assert plant.crashed is not None and plant.crashed.startswith("flip")
    plant = Plant(Scene())
    plant.step(np.full(6, math.nan))
    plant.step(plant.thrusts_actual)
    assert plant.crashed == "non-finite thrust command" and plant.time_ns == 2 * TICK_NS
    assert np.isfinite(plant.position).all()
