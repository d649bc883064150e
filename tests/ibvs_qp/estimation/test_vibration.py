"""Noise of the accelerometer measured in flight, and the filters that follow it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimators import ContactEstimator
from symbolic_block import Block

from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.noise import noise_density, vibration_variance

TICK = 0.004
DOWN = (0.0, 0.0, 1.0)
#: Camera to tip along the normal [m]: a wall at distance d of the tip has depth d + AHEAD in the camera.
CONFIG = ControllerConfig()
AHEAD = CONFIG.vehicle.tip_position_m[0] - CONFIG.vehicle.camera_position_m[0]


def plane(distance: float) -> tuple[float, float, float, float]:
    return 0.0, 0.0, 1.0 / (distance + AHEAD), -1.0


class Wall:
    """The estimator of a vehicle that does not turn and touches nothing."""

    def __init__(self) -> None:
        self._estimator = ContactEstimator(CONFIG)

    def update(
        self,
        stamp_ns: int,
        force: tuple[float, float, float],
        down: tuple[float, float, float] = DOWN,
        seen: tuple[tuple[float, float, float, float], int] | None = None,
    ) -> ContactState:
        return self._estimator.update(
            stamp_ns=stamp_ns,
            specific_force=force,
            down=down,
            plane=seen and seen[0],
            plane_stamp_ns=seen[1] if seen else 0,
        )


def fly(
    seconds: float, sigma: float = 0.0, bias: float = 0.0, tilt: float = 0.0, distance: float = 0.3, leap: float = 0.0
) -> tuple[ContactState, np.ndarray, Wall]:
    """A vehicle at rest with noise [m/s^2], bias [m/s^2] and pitch error [rad]; last estimate and all rates [m/s].

    Half-way the bias leaps by ``leap`` [m/s^2].
    """
    wall, rng, rates = Wall(), np.random.default_rng(0), []
    down = (-math.sin(tilt), 0.0, math.cos(tilt))
    for tick in range(int(seconds / TICK)):
        stamp = (tick + 1) * 4_000_000
        bias += leap * (tick == int(0.5 * seconds / TICK))
        force = (bias + sigma * rng.standard_normal(), 0.0, -9.81)
        seen = None
        if tick % 8 == 0 and tick > 15:
            seen = plane(distance + 0.001 * rng.standard_normal()), stamp - 60_000_000
        state = wall.update(stamp, force, down, seen)
        rates.append(state.rate)
    return state, np.array(rates), wall


def variance() -> Block:
    """Averaged over a second."""
    return Block(
        lambda signals: vibration_variance(signals, signals.input("acceleration"), signals.input("dt"), time_s=1.0)
    )


@pytest.mark.parametrize("sigma", [0.06, 0.5, 1.0])
def test_white_noise_is_measured(sigma: float) -> None:
    noise, rng = variance(), np.random.default_rng(0)
    for sample in sigma * rng.standard_normal(2000):
        found = noise(acceleration=2.0 + sample)[0]
    assert math.sqrt(found) == pytest.approx(sigma, rel=0.1)
    assert float(noise_density(found, 6e-3, TICK)) == pytest.approx(max(6e-3**2, found * TICK))


def test_motion_is_no_noise() -> None:
    noise = variance()
    for tick in range(2000):
        found = noise(acceleration=2.0 * math.sin(2.0 * math.pi * 1.0 * tick * TICK))[0]  # 2 m/s^2 at 1 Hz
    assert math.sqrt(found) < 0.04


@pytest.mark.parametrize("bias", [-0.15, 0.15])
def test_the_accelerometer_bias_along_the_normal_is_learnt(bias: float) -> None:
    wall, *_ = fly(8.0, bias=bias, sigma=0.06)
    assert wall.bias == pytest.approx(bias, abs=0.02)


@pytest.mark.parametrize("sigma", [0.06, 0.4, 0.6])
def test_a_wandering_bias_leaves_no_standing_speed(sigma: float) -> None:
    """A wrong bias is a wrong closing speed: at 8 mm/s the tip stands still off the wall until the press times out."""
    _, rates, _ = fly(40.0, sigma=sigma, leap=0.07)
    assert abs(rates[-4000:].mean()) < 1e-3
    after = rates[5000 + 1250 : 5000 + 2500]  # 5 to 10 s after the leap
    assert abs(after.mean()) < 1.5e-3


@pytest.mark.parametrize("leap", [-0.5, 0.5])
def test_an_attitude_that_leaps_by_3_degrees_leaves_no_false_speed_after_a_second(leap: float) -> None:
    """A filter sure of its bias refuses the planes; the tip then pressed with 14 N."""
    _, rates, _ = fly(12.0, sigma=0.06, leap=leap)
    half, second = 1500 + 125, 1500 + 250  # after the leap
    assert abs(rates[half:second]).max() < 0.1 and abs(rates[second:]).max() < 0.03


@pytest.mark.parametrize("degrees", [-1.5, 1.5])
def test_gravity_through_an_attitude_error_is_learnt(degrees: float) -> None:
    wall, *_ = fly(8.0, tilt=math.radians(degrees), sigma=0.06)
    assert wall.bias == pytest.approx(-9.81 * math.sin(math.radians(degrees)), abs=0.03)


@pytest.mark.parametrize("sigma", [0.3, 1.0])
def test_the_noise_of_the_rate_is_known_and_no_plane_is_refused(sigma: float) -> None:
    wall, rates, _ = fly(20.0, sigma=sigma)
    late = rates[2000:]
    assert 0.4 * wall.rate_noise < late.std() < 2.0 * wall.rate_noise
    assert abs(wall.distance - 0.3) < 0.01 and abs(late).max() < 5.0 * wall.rate_noise


def test_a_filter_that_refuses_restarts_with_distance_and_speed() -> None:
    *_, flown = fly(4.0)
    ticks = 8 * (CONFIG.contact.estimation.refused_frames - 1) + 1
    for tick in range(ticks):  # the wall moves away at 0.2 m/s after a leap of 0.3 m; the accelerometer shows nothing
        stamp = (1001 + tick) * 4_000_000
        seen = (plane(0.6 + 0.2 * tick * TICK), stamp) if tick % 8 == 0 else None
        wall = flown.update(stamp, (0.0, 0.0, -9.81), seen=seen)
    assert wall.distance == pytest.approx(0.6 + 0.2 * (ticks - 1) * TICK, abs=0.01)
    assert wall.rate == pytest.approx(0.2, abs=0.02)
