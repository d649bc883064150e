"""Kalman filter of push and disturbance: a mass with lagged rotors on the spring of a brush."""

from __future__ import annotations

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest
from symbolic_block import Block

from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.contact_margin import ContactLoop
from ibvs_qp.estimation.push_disturbance import FORCE_BOUND, SLOW_BOUND, Normal, PushDisturbance

CONFIG = ControllerConfig()
MASS, DAMPING, TICK = CONFIG.vehicle.mass_kg, CONFIG.brush.damping_n_s_m, CONFIG.tick_s
#: Age of the force sample in ticks: that of the configuration, rounded.
LATE = round(CONFIG.brush.force_delay_s / TICK)


def build(signals):
    along = Normal(*(signals.input("dt" if name == "dt" else f"in_{name}") for name in Normal._fields))
    found = PushDisturbance(signals, CONFIG, along)
    return ca.vertcat(found.push, found.rate, found.gust, found.slow, found.acceleration, found.external)


class Wall:
    """A vehicle pushed onto the wall by a constant force, and the filter beside it."""

    def __init__(self, stiffness: float = 1500.0, noise: float = 0.0, vibration: float = 0.0, seed: int = 0) -> None:
        self.rng, self.stiffness, self.noise, self.vibration = np.random.default_rng(seed), stiffness, noise, vibration
        self.depth, self.speed, self.pushes = 5.0 / stiffness, 0.0, [5.0] * (LATE + 1)
        self.block = Block(build)
        inputs = {
            "touching": 1.0,
            "felt": 1.0,
            "stiffness": stiffness,
            "stiffness_known": 1.0,
            "push": 5.0,
            "vibration": max(vibration, 0.06) * MASS,
        }
        inputs |= {"push_density": max(noise, 0.02) ** 2 * TICK}
        self.block(**{f"in_{name}": value for name, value in inputs.items()})

    def tick(self, thrust: float, wind: float = 0.0, unfelt: float = 0.0, **inputs: float) -> np.ndarray:
        """One tick: estimate minus truth of push [N] and rate [m/s], and the forces [N]."""
        steps = 20
        for _ in range(steps):
            push = self.stiffness * self.depth + DAMPING * self.speed
            acceleration = (thrust + wind + unfelt - push) / MASS
            self.speed += TICK / steps * acceleration
            self.depth += TICK / steps * self.speed
        push = self.stiffness * self.depth + DAMPING * self.speed
        self.pushes = [push, *self.pushes[:-1]]
        felt = thrust + wind - push + MASS * self.rng.normal(0.0, self.vibration)
        measured = {"in_push": self.pushes[LATE] + self.rng.normal(0.0, self.noise), "in_inertial": felt}
        found = self.block(in_thrust=thrust, **(measured | inputs))
        return found[:5] - np.array([push, self.speed, 0.0, 0.0, 0.0])


def flown(wall: Wall, ticks: int, **forces) -> np.ndarray:
    return np.array([wall.tick(5.0, **{name: value(n * TICK) for name, value in forces.items()}) for n in range(ticks)])


def test_a_force_is_told_by_whether_the_accelerometer_measures_it() -> None:
    wind = flown(Wall(), 3000, wind=lambda t: 2.0)[-1]
    np.testing.assert_allclose(wind[2:4], [2.0, 0.0], atol=0.05)
    leak = flown(Wall(), 6000, unfelt=lambda t: 0.7)[-1]
    np.testing.assert_allclose(leak[2:4], [0.0, 0.7], atol=0.05)


def test_both_forces_together_explain_any_push_that_lasts() -> None:
    """Whatever is wrong: what remains of a constant force is no error of the push."""
    both = flown(Wall(noise=0.2, vibration=0.42), 8000, wind=lambda t: -1.5, unfelt=lambda t: 0.5)
    assert np.mean(both[-2000:, 2] + both[-2000:, 3]) == pytest.approx(-1.0, abs=0.05)
    assert abs(np.mean(both[-2000:, 0])) < 0.05


def test_gusts_are_followed_by_the_datasheet_sensors() -> None:
    """A gust of 2 N rms and 2 s of period; the force sensor 0.2 N at 100 Hz, the accelerometer 0.42 m/s^2 a sample."""
    wall = Wall(noise=0.32, vibration=0.42)
    times = TICK * np.arange(5000)
    found = flown(wall, 5000, wind=lambda t: 2.8 * math.sin(math.pi * t))
    error = (found[:, 2] + found[:, 3] - 2.8 * np.sin(math.pi * times))[1000:]
    assert np.sqrt(np.mean(error**2)) < 0.6
    assert np.std(found[1000:, 0]) < 0.22  # push [N]; a sample has 0.32 N
    assert np.std(found[1000:, 1]) < 0.004  # rate [m/s]


def test_calm_air_is_filtered_more_than_gusts() -> None:
    calm = flown(Wall(noise=0.32, vibration=0.42), 4000)[1000:]
    assert np.std(calm[:, 2]) < 0.12
    gusty = Wall(noise=0.32, vibration=0.42)
    noisy = []
    for _ in range(2000):
        gusty.block.step.states["gust_power"][:] = 1e3
        noisy.append(gusty.tick(5.0)[2])
    assert np.std(noisy[500:]) > 4.0 * np.std(calm[:, 2])


def test_vibration_is_no_gust() -> None:
    """3 N per sample that are known as noise leave the force at rest; unknown they do not."""

    def passed_on(known: float) -> float:
        wall = Wall(vibration=0.5)
        wall.block.step.inputs["in_vibration"][:] = MASS * known
        return float(np.std(flown(wall, 2000)[500:, 2]))

    assert passed_on(0.5) < 0.15 < 0.5 < passed_on(0.06)


def test_noise_of_the_force_sensor_is_no_gust() -> None:
    """3 N per sample that are known as noise leave the force at rest; unknown they do not."""

    def passed_on(known: float) -> float:
        wall = Wall(noise=3.0)
        wall.block.step.inputs["in_push_density"][:] = known**2 * TICK
        return float(np.std(flown(wall, 2000)[500:, 2]))

    assert passed_on(3.0) < 0.15 < 0.5 < passed_on(0.3)


def test_a_spike_of_the_force_sensor_counts_little() -> None:
    wall = Wall(noise=0.2, vibration=0.1)
    flown(wall, 1000)
    worst = max(abs(wall.tick(5.0, in_push=100.0)[0]) for _ in range(3))
    assert worst < 1.0


@pytest.mark.parametrize("vibration", [0.06, 1.0])
def test_a_push_on_a_wall_of_unknown_stiffness_is_the_measured_one(vibration: float) -> None:
    """Believed to be 10 kN/m, the wall is a brush of 1.5 kN/m; wind of 0.7 N rms at the frequency of the contact."""

    def error(known: float) -> float:
        wall = Wall(noise=0.3, vibration=vibration)
        wall.block.step.inputs["in_stiffness"][:] = 10_000.0
        wall.block.step.inputs["in_stiffness_known"][:] = known
        swing = flown(wall, 1000, wind=lambda t: 1.0 * math.sin(15.0 * t))
        return float(np.sqrt(np.mean(swing[250:, 0] ** 2)))

    assert error(0.0) < 0.6
    assert error(1.0) > 2.5 * error(0.0)


def test_a_touch_begins_with_measured_push_and_rate() -> None:
    block = Block(build)
    block(in_touching=0.0, in_felt=1.0, in_push=1.2, in_rate=0.03, in_external=0.8, in_bias=0.05, in_stiffness=1500.0)
    np.testing.assert_allclose(block(in_touching=0.0)[:4], [1.2, 0.03, 0.8, -0.05 * MASS])
    following = block(in_touching=1.0, in_push_density=1e3, in_vibration=1e3)
    assert following[1] == pytest.approx(0.03, abs=2e-3) and following[0] > 1.2


def test_a_hole_in_the_ticks_begins_anew_and_nothing_leaves_the_bounds() -> None:
    wall = Wall(stiffness=20_000.0)
    flown(wall, 500)
    after = wall.block(dt=0.4, in_push=3.0, in_inertial=0.0)
    assert abs(after[0]) < 10.0 and np.isfinite(after).all()
    wall.block(dt=TICK)
    for _ in range(3000):
        wild = wall.block(in_inertial=1e4, in_push=-1e4)
    assert np.isfinite(wild).all() and abs(wild[2]) <= FORCE_BOUND and abs(wild[3]) <= MASS * SLOW_BOUND


def test_without_an_accelerometer_the_force_sensor_alone_tells_a_constant_force() -> None:
    wall = Wall(noise=0.1)
    wall.block.step.inputs["in_felt"][:] = wall.block.step.inputs["in_stiffness_known"][:] = 0.0  # it stays unknown
    found = np.array([wall.tick(5.0, wind=1.5, in_inertial=0.0) for _ in range(6000)])
    assert np.mean(found[-1000:, 2] + found[-1000:, 3]) == pytest.approx(1.5, abs=0.1)
    assert abs(np.mean(found[-1000:, 0])) < 0.03 and abs(np.mean(found[-1000:, 4])) < 0.02


def test_the_force_of_free_flight_goes_on_at_touch_and_loss() -> None:
    """Forces and bias together are one force, so the command does not jump."""
    block = Block(build)
    free = {"in_felt": 1.0, "in_external": 0.8, "in_bias": 0.05, "in_stiffness": 1500.0, "in_vibration": 0.6}
    assert block(in_touching=0.0, in_push_density=1e-4, **free)[5] == pytest.approx(0.8)
    assert block(in_touching=1.0, in_inertial=0.8)[5] == pytest.approx(0.8, abs=0.05)


@pytest.mark.parametrize("mass", [2.0, 12.0])
def test_the_mass_is_the_vehicles(mass: float) -> None:
    config = dataclasses.replace(CONFIG, vehicle=dataclasses.replace(CONFIG.vehicle, mass_kg=mass))
    block = Block(
        lambda signals: (
            PushDisturbance(
                signals, config, Normal(*(signals.input("dt" if n == "dt" else f"in_{n}") for n in Normal._fields))
            ).acceleration
        )
    )
    inputs = {"touching": 1.0, "thrust": 3.0, "weight": 2.0, "push": 1.0, "vibration": 1.0, "push_density": 1e3}
    assert block(**{f"in_{name}": value for name, value in inputs.items()})[0] == pytest.approx(4.0 / mass, rel=0.1)


@pytest.mark.parametrize("gusts", [False, True])
def test_the_linear_loop_of_the_margin_has_the_gain_of_this_filter(gusts: bool) -> None:
    loop = ContactLoop(CONFIG, 1500.0, DAMPING, CONFIG.brush.force_delay_s, gusts=gusts)
    wall = Wall()
    wall.block.step.inputs["in_push_density"][:] = loop.push_density
    wall.block.step.inputs["in_vibration"][:] = MASS * loop.vibration
    for _ in range(4000):
        wall.block.step.states["gust_power"][:] = 1e9 * gusts
        wall.tick(5.0)
    covariance = np.zeros((4, 4))
    covariance.T[np.triu_indices(4)] = wall.block.step.states["push_kalman.covariance"]
    covariance += np.tril(covariance, -1).T
    transition, rows, gain = loop._filter()
    prior = transition @ covariance @ transition.T + TICK * np.diag(loop.noise)
    measured = np.diag([loop.push_density / TICK, (MASS * loop.vibration) ** 2])
    own = prior @ rows.T @ np.linalg.inv(rows @ prior @ rows.T + measured)
    np.testing.assert_allclose(own, gain, rtol=1e-4, atol=1e-6)
