"""Specific force for the motion in the wall plane, by the motors' model and the accelerometer."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from symbolic_block import Block

from ibvs_qp.config import EstimationConfig
from ibvs_qp.estimation.plane_acceleration import plane_force
from ibvs_qp.pilot import Pilot
from sim.experiments.scenes import near_wall
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World

TICK, DELAY, NORMAL, FREE = 0.004, 0.009, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
HOVER = np.array([0.0, 0.0, -9.81])


class PlaneAcceleration:
    """Specific force of a tick, and its noise."""

    def __init__(self, config: EstimationConfig) -> None:
        def build(signals):
            arrays = {name: signals.input(name, 3) for name in ("measured", "motors", "contact", "normal")}
            numbers = {name: signals.input(name) for name in ("dt", "use_model")}
            return ca.vertcat(*plane_force(signals, config, delay_s=DELAY, **arrays, **numbers))

        self._block, self.density = Block(build), 0.0

    def update(self, dt: float, measured: Any, motors: Any, contact: Any, normal: Any, use_model: bool) -> list[float]:
        inputs = {"measured": measured, "motors": motors, "contact": contact, "normal": normal}
        *force, self.density = self._block(dt=dt, use_model=use_model, **inputs).tolist()
        return force


def fly(
    seconds: float = 20.0,
    noise: float = 0.0,
    wind: Callable[[float], float] = lambda time: 0.0,
    config: EstimationConfig | None = None,
) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Hover in wind along y [m/s^2] with noise of the accelerometer [m/s^2 a sample].

    Returns:
        Estimate less truth, in B [m/s^2], (n, 3), the truth (n, 3), and the noise found [m^2/s^3].
    """
    estimator, rng = PlaneAcceleration(config or EstimationConfig()), np.random.default_rng(0)
    truths, errors, densities = [], [], []
    for tick in range(round(seconds / TICK)):
        truth = HOVER + np.array((0.0, wind(tick * TICK), 0.0))
        measured = truth + noise * rng.standard_normal(3)
        errors.append(np.array(estimator.update(TICK, measured, HOVER, FREE, NORMAL, True)) - truth)
        truths.append(truth)
        densities.append(estimator.density)
    return np.array(errors), np.array(truths), densities


def test_the_accelerometer_alone_counts_before_the_first_command() -> None:
    estimator = PlaneAcceleration(EstimationConfig())
    for measured in ([0.3, -0.2, -9.7], [0.1, 0.4, -9.9]):
        assert estimator.update(TICK, measured, FREE, FREE, NORMAL, True) == pytest.approx(measured)


@pytest.mark.parametrize("noise", [0.06, 1.0, 2.0])
def test_white_noise_is_measured_and_no_motion(noise: float) -> None:
    errors, _, densities = fly(noise=noise)
    density = noise**2 * TICK
    assert np.mean(densities[1000:]) == pytest.approx(density, rel=0.25)
    # In the quarter of a second that a line's loop takes, the accelerometer's noise makes a velocity of this deviation.
    velocity = TICK * errors[1000:4969, 1:].reshape(-1, 63, 2).sum(axis=1)
    assert velocity.std() < 0.4 * math.sqrt(density * 0.25)


@pytest.mark.parametrize("noise", [0.0, 0.06])
def test_gusts_are_motion(noise: float) -> None:
    """Gusts of 3 N on 6 kg, at 0.3 and 0.8 Hz."""

    def wind(time: float) -> float:
        return 0.5 * math.sin(2.0 * math.pi * 0.3 * time) + 0.4 * math.sin(2.0 * math.pi * 0.8 * time)

    errors, truths, _ = fly(wind=wind, noise=noise)
    assert errors[1000:, 1].std() < 0.1 * truths[1000:, 1].std() + noise


@pytest.mark.parametrize("seconds", [0.2, 1.0])
def test_an_error_of_the_motors_model_is_no_noise_and_no_motion(seconds: float) -> None:
    """The model errs by 0.5 m/s^2 with this period while the vehicle hovers: rotors slower than assumed."""
    estimator, rng, errors = PlaneAcceleration(EstimationConfig()), np.random.default_rng(0), []
    for tick in range(5000):
        motors = HOVER + np.array((0.0, 0.5 * math.sin(2.0 * math.pi * tick * TICK / seconds), 0.0))
        measured = HOVER + 0.06 * rng.standard_normal(3)
        errors.append(estimator.update(TICK, measured, motors, FREE, NORMAL, True)[1] - measured[1])
    assert np.std(errors[1000:]) < 0.15 * 0.5 / math.sqrt(2.0)
    assert estimator.density < 3.0 * 0.06**2 * TICK


def test_blind_the_accelerometer_alone_counts() -> None:
    estimator, rng = PlaneAcceleration(EstimationConfig()), np.random.default_rng(0)
    for tick in range(500):
        measured = HOVER + 0.06 * rng.standard_normal(3)
        force = estimator.update(TICK, measured, HOVER, FREE, NORMAL, tick < 400)
        assert (force == pytest.approx(measured)) is (tick >= 400)


def test_friction_that_rises_with_the_thrust_is_no_motion() -> None:
    """A tip that is stuck for 4 s is drawn by 10 N/s on 6 kg; the force sample is one delay old, the motors' a tick."""
    estimator, rate = PlaneAcceleration(EstimationConfig()), 10.0 / 6.0
    velocity = 0.0
    for tick in range(-1000, 250):
        time = tick * TICK
        motors = HOVER + np.array((0.0, rate * max(time - TICK, 0.0), 0.0))
        contact = (0.0, -rate * max(time - DELAY, 0.0), 0.0)
        force = estimator.update(TICK, HOVER, motors, contact, NORMAL, True)
        velocity += TICK * force[1] * (tick >= 0)
    assert abs(velocity) < 0.002  # 0.006 m/s without the lead


def test_a_spike_of_the_force_sensor_leaves_the_noise() -> None:
    """150 N for 10 ms in the wall plane."""
    estimator, rng = PlaneAcceleration(EstimationConfig()), np.random.default_rng(0)
    for tick in range(2500):
        contact = (0.0, 25.0 * (2000 <= tick < 2003), 0.0)
        force = estimator.update(TICK, HOVER + 0.06 * rng.standard_normal(3), HOVER, contact, NORMAL, True)
    assert abs(force[1]) < 0.3 and estimator.density < 2.0 * 0.06**2 * TICK


def test_a_bias_is_known_within_half_a_second() -> None:
    errors, *_ = fly(seconds=1.0, wind=lambda time: 0.03, noise=0.06)
    assert abs(errors[125:, 1].mean()) < 0.012


def test_a_steady_wind_is_followed() -> None:
    errors, *_ = fly(wind=lambda time: 0.5, noise=0.06)
    assert abs(errors[2000:, 1].mean()) < 0.02


@pytest.mark.parametrize("noise", [0.0, 0.06])
def test_a_wind_that_leaps_is_motion_at_once(noise: float) -> None:
    """A wind of 4 m/s: 3.6 N on 6 kg. By the rest of the model alone the velocity would be 0.2 m/s wrong."""
    errors, *_ = fly(wind=lambda time: 0.6 * (time > 5.0), noise=noise)
    velocity = TICK * errors[1250:, 1].cumsum()
    assert abs(velocity[:125]).max() < 0.03


def test_the_pilot_integrates_the_force_by_model_and_accelerometer_with_its_noise() -> None:
    """White noise of 1 m/s^2 a sample in calm air, while the tip presses."""
    options = FlightOptions(features="geometric", video=False)
    scene = near_wall()
    scene = dataclasses.replace(scene, imu=dataclasses.replace(scene.imu, accel_density=math.sqrt(TICK)))
    config = pilot_config(scene, options)
    pilot, world = Pilot(config), World(scene, options, config)
    frames, velocities, densities = [], [], []
    while len(densities) < 500:
        frames.append(world.sense())
        world.act(pilot.step(frames[-1]).thrusts)
        if pilot.contact.state.in_contact:
            velocities.append(pilot.motion.state[0])
            densities.append(pilot.motion.density)
        assert len(frames) < 5000
    measured = np.array([frame.specific_force for frame in frames[-250:]])
    changes = np.diff(velocities[-250:]) / TICK
    assert measured[:, 1].std() > 0.9 and np.percentile(np.abs(changes), 68.0) < 0.5
    assert densities[-1] == pytest.approx(TICK, rel=0.5)


def test_without_a_calm_change_the_accelerometer_alone_counts() -> None:
    errors, *_ = fly(seconds=1.0, noise=1.0, config=EstimationConfig(calm_change=0.0))
    assert errors.std() == pytest.approx(1.0, rel=0.1)
