"""The brush on the board: stiffness, damping, Coulomb friction and sticking, measured on the flown model.

The rig holds the vehicle's model by a strong position and attitude controller on its body, with gravity balanced and
rotors at rest, and pushes it at the wall with a constant force.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.world.mjcf import build_model
from sim.world.plant_scene import PlantScene
from sim.world.scene import Scene, WallScene
from sim.world.true_vehicle import true_vehicle

DT = 0.001
STIFF_N_M, DAMP_N_S_M, TURN_N_M, TURN_DAMP = 4000.0, 300.0, 800.0, 40.0


@dataclass
class Record:
    """At every physics step: normal force, friction (left, up), x of the tip, y velocity of the tip, F/T force."""

    normal: np.ndarray
    friction: np.ndarray
    depth: np.ndarray
    slip: np.ndarray
    sensor: np.ndarray


class Rig:
    def __init__(self, wall: WallScene, plant: PlantScene | None = None, gap: float = 0.0) -> None:
        scene = Scene(wall=wall, plant=plant or PlantScene())
        vehicle = true_vehicle(scene, VehicleParams())
        self.mass = vehicle.mass_kg
        self.model, self.ids = build_model(scene, vehicle)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:7] = [-0.70 - gap, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0]
        # The rig acts at the body origin; MuJoCo applies forces at the bare vehicle's centre of mass.
        self.arm = -self.model.body_ipos[self.ids.vehicle]

    def run(self, seconds: float, push: float, speed: float = 0.0, side_force: float | None = None) -> Record:
        """Push and slide to the right (MuJoCo -y) at a speed, or pull sideways with a force instead."""
        data, rows, target = self.data, [], self.data.qpos[1]
        slices = self.ids
        for _ in range(round(seconds / DT)):
            x, v, turn, rate = data.qpos[:3], data.qvel[:3], data.qpos[4:7], data.qvel[3:]
            target -= speed * DT
            side = STIFF_N_M * (target - x[1]) + DAMP_N_S_M * (-speed - v[1])
            side = side if side_force is None else -side_force
            lift = STIFF_N_M * (2.0 - x[2]) - DAMP_N_S_M * v[2] + self.mass * GRAVITY
            force = np.array([push, side, lift])
            data.xfrc_applied[slices.vehicle, :3] = force
            data.xfrc_applied[slices.vehicle, 3:] = np.cross(self.arm, force) - 2 * TURN_N_M * turn - TURN_DAMP * rate
            mujoco.mj_step(self.model, data)
            found, normal, first, second, *axes = data.sensordata[slices.contact]
            tangent = first * np.array(axes[3:]) + second * np.cross(axes[:3], axes[3:])
            row = [
                normal * (found > 0),
                *(-tangent[1:]),
                x[0] + 0.70,
                v[1] + 0.70 * rate[2],
                *data.sensordata[slices.force],
            ]
            rows.append(row)
        table = np.array(rows)
        return Record(table[:, 0], table[:, 1:3], table[:, 3], table[:, 4], table[:, 5:])


@pytest.mark.parametrize("speed", [0.1, 0.2])
@pytest.mark.parametrize("friction", [0.3, 0.8])
def test_sliding_tip_keeps_its_force_and_coulomb_friction(friction, speed):
    rig = Rig(WallScene(friction=friction))
    rig.run(2.0, push=5.0, speed=speed)
    record = rig.run(2.0, push=5.0, speed=speed)
    assert record.slip.mean() == pytest.approx(-speed, rel=0.01)
    assert record.normal.mean() == pytest.approx(5.0, abs=0.01)
    assert record.normal.std() <= 0.05
    assert record.normal.min() > 4.5
    ratio = np.linalg.norm(record.friction, axis=1) / record.normal
    assert np.all(np.abs(ratio / friction - 1.0) <= 0.01)
    assert np.all(record.friction[:, 0] > 0.0), "friction acts on the tip against its motion"


@pytest.mark.parametrize(("stiffness", "friction"), [(1000.0, 0.1), (3000.0, 0.8), (10000.0, 0.8), (50000.0, 0.8)])
def test_no_chatter_over_the_range_of_walls(stiffness, friction):
    rig = Rig(WallScene(stiffness_n_m=stiffness, friction=friction))
    rig.run(2.0, push=5.0, speed=0.2)
    record = rig.run(1.0, push=5.0, speed=0.2)
    assert record.normal.std() <= 0.05
    assert np.abs(np.linalg.norm(record.friction, axis=1) / record.normal / friction - 1.0).max() <= 0.01


@pytest.mark.parametrize("mass", [5.0, 7.5])
@pytest.mark.parametrize("stiffness", [1000.0, 1500.0, 10000.0])
def test_static_penetration_is_force_over_stiffness(stiffness, mass):
    damping = 2.0 * np.sqrt(stiffness * mass)  # critical, so that the rig comes to rest
    rig = Rig(WallScene(stiffness_n_m=stiffness, damping_n_s_m=min(damping, 500.0)), PlantScene(mass_kg=mass))
    record = rig.run(3.0, push=5.0)
    assert record.depth[-1] == pytest.approx(5.0 / stiffness, rel=0.02)
    assert record.normal[-1] == pytest.approx(5.0, rel=1e-3)


@pytest.mark.parametrize(("stiffness", "damping"), [(1500.0, 30.0), (10000.0, 30.0), (1500.0, 150.0)])
def test_touch_is_that_of_mass_spring_and_damper(stiffness, damping):
    gap, speed, mass = 0.0105, 0.1, 6.0
    rig = Rig(WallScene(stiffness_n_m=stiffness, damping_n_s_m=damping), gap=gap)
    rig.data.qvel[0] = speed
    record = rig.run(1.0, push=0.0)
    depth, rate, forces = -gap, speed, []
    for _ in range(100 * len(record.normal)):
        force = max(0.0, stiffness * depth + damping * rate) if depth > 0.0 else 0.0
        rate -= force / mass * DT / 100
        depth += rate * DT / 100
        forces.append(force)
    assert record.normal.max() == pytest.approx(max(forces), rel=0.03)
    assert record.normal.sum() == pytest.approx(sum(forces) / 100, rel=0.03), "same impulse, same rebound"
    assert record.normal.min() >= 0.0, "never sticks to the board"


def test_tip_held_by_friction_does_not_creep():
    rig = Rig(WallScene(friction=0.3))
    rig.run(2.0, push=5.0, side_force=0.0)
    record = rig.run(1.0, push=5.0, side_force=0.5 * 0.3 * 5.0)
    assert np.abs(record.slip[500:]).max() < 1e-5
    assert record.friction[-1, 0] == pytest.approx(0.75, rel=5e-3)


def test_sliding_vehicle_stops_by_coulomb_friction():
    rig = Rig(WallScene(friction=0.3))
    rig.run(1.5, push=5.0, side_force=0.0)
    rig.data.qvel[1] = -0.05
    record = rig.run(0.6, push=5.0, side_force=0.0)
    # 0.05 m/s against 1.5 N on 6 kg: stops after 0.2 s, at a constant deceleration.
    assert record.slip[100] == pytest.approx(-0.025, abs=0.003)
    assert abs(record.slip[300]) < 1e-3


def test_force_torque_sensor_reads_the_push_and_the_tool_weight():
    rig = Rig(WallScene(friction=0.0))
    free = rig.run(0.5, push=0.0).sensor[-1]
    np.testing.assert_allclose(free, [0.0, 0.0, 0.35 * GRAVITY], atol=1e-3)  # up, front-left-up
    pressed = rig.run(3.0, push=5.0).sensor[-1]
    np.testing.assert_allclose(pressed, [5.0, 0.0, 0.35 * GRAVITY], atol=0.01)
