"""Air on the vehicle: drag, mean wind and gusts."""

import math

import numpy as np
import pytest

from sim.world.errors import AirErrors
from sim.world.plant import Plant
from sim.world.plant_scene import PlantScene
from sim.world.scene import Scene, StartScene, WindScene
from sim.world.wind import Wind


def fly(plant: Plant, thrusts: np.ndarray, ticks: int) -> None:
    for _ in range(ticks):
        plant.step(thrusts)


def test_drag_and_mean_wind_reach_the_air_speed():
    scene = Scene(wind=WindScene(mean_m_s=(0.0, 3.0, 0.0)), start=StartScene(distance_m=2.0))
    plant = Plant(scene)
    thrusts = plant.thrusts_actual
    fly(plant, thrusts, 250)
    # No moment about the centre of mass: v = 3 (1 - exp(-0.9 t / 6)).
    world = plant.rotation @ plant.velocity
    assert world[1] == pytest.approx(-3.0 * math.expm1(-0.9 / 6.0), rel=1e-3)
    assert np.abs(plant.angular_velocity).max() < 1e-9


def test_air_acts_at_the_true_centre_of_mass():
    truth = PlantScene(com_offset_m=(0.03, 0.02, -0.03))
    plant = Plant(Scene(wind=WindScene(mean_m_s=(0.0, 8.0, 0.0)), plant=truth, start=StartScene(distance_m=2.0)))
    fly(plant, plant.thrusts_actual, 25)
    assert np.abs(plant.angular_velocity).max() < 1e-9


def test_gusts_have_their_rms_and_time_constant():
    wind = Wind(WindScene(gust_n_rms=2.0), AirErrors(), np.eye(3), 0.9, 0.004, 1)
    gusts = np.array([wind.force(np.zeros(3)) for _ in range(100_000)])
    np.testing.assert_allclose(gusts.std(), 2.0, rtol=0.1)  # 400 s hold 200 independent gusts per axis
    lag = 250
    correlation = (gusts[lag:] * gusts[:-lag]).mean(axis=0) / gusts.var(axis=0)
    np.testing.assert_allclose(correlation, math.exp(-1.0), atol=0.15)
