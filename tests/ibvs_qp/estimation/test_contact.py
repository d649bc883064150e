"""Distance, inertial rate, touch and loss: one-dimensional approaches with late depth and a biased accelerometer."""

from __future__ import annotations

import math

import numpy as np
import pytest
from controller_scenes import TICK_NS, Wall, attitude, measured
from estimators import ContactEstimator

from ibvs_qp.config import ContactSettings, ControllerConfig
from ibvs_qp.estimation.contact_state import ContactState

LEVEL = attitude()


def approach_speed(t: float) -> float:
    """Forward speed of the tip [m/s]: at rest, then back and forth at two frequencies."""
    return 0.0 if t < 2.0 else 0.05 * math.sin(2 * math.pi * 0.5 * t) + 0.02 * math.sin(2 * math.pi * 2.0 * t)


def run(latency_ticks: int, seconds: float = 12.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(time, true rate of the distance, estimated rate) with depth at 30 Hz that late."""
    config, rng = ControllerConfig(), np.random.default_rng(4)
    estimator, dt = ContactEstimator(config), config.tick_s
    distance, distances, rows, plane = 0.3, [], [], None
    for k in range(int(seconds / dt)):
        t = k * dt
        speed = approach_speed(t)
        distance -= dt * speed
        distances.append(distance)
        acceleration = (approach_speed(t) - approach_speed(t - dt)) / dt
        force = np.array([acceleration + 0.05 + rng.normal(0.0, 0.05), 0.0, -9.81])
        if k % 8 == 0 and k >= latency_ticks:
            noisy = distances[k - latency_ticks] + rng.normal(0.0, 1e-3)
            plane = Wall(LEVEL, noisy).plane, (k - latency_ticks + 1) * TICK_NS
        changes = {"plane": plane[0], "plane_stamp_ns": plane[1]} if plane else {"plane": None}
        state = estimator.measure(measured(k, specific_force=force, **changes))
        rows.append((t, -speed, state.rate))
    times, true, found = np.array(rows).T
    return times, true, found


@pytest.mark.parametrize("latency", [15, 25])
def test_the_rate_lags_by_less_than_20_ms_with_depth_60_and_100_ms_late(latency: int) -> None:
    times, true, found = run(latency)
    late = times > 6.0
    lags = np.arange(-10, 26)
    errors = [np.std(np.roll(true, lag)[late] - found[late]) for lag in lags]
    best = int(lags[int(np.argmin(errors))])
    error = np.std(true[late] - found[late])
    print(f"latency {latency * 4} ms: lag of the rate {best * 4} ms, error {error * 1e3:.1f} mm/s rms")
    assert best * 4 <= 20
    assert error < 0.008  # of 38 mm/s rms


def test_differentiated_depth_would_lag_by_its_whole_latency() -> None:
    """Why the accelerometer is there: the bare difference of 60 ms late depth lags more than the bound."""
    times = np.arange(0.0, 12.0, 0.004)
    speeds = np.array([approach_speed(t) for t in times])
    depth = 0.3 - np.cumsum(speeds) * 0.004
    late = np.interp(times - 0.060, times, depth)[::8]
    rate = np.repeat(np.gradient(late, 0.032), 8)[: len(times)]
    lags = np.arange(0, 40)
    errors = [np.std((np.roll(-speeds, lag) - rate)[1600:]) for lag in lags]
    assert lags[int(np.argmin(errors))] * 4 > 40


def test_a_turning_body_moves_the_tip_although_its_centre_stays() -> None:
    """Yaw at a wall that stands askew: the tip's rate along the normal is that of the lever."""
    config = ControllerConfig()
    estimator, turn = ContactEstimator(config), 0.2
    rate = 0.1
    for k in range(500):
        yaw = rate * k * config.tick_s
        wall = Wall(LEVEL, 0.2, turn - yaw)  # distance measured at the nominal tip, whatever; only the rate matters
        spin = np.array([0.0, 0.0, rate])
        state = estimator.measure(measured(k, angular_velocity=spin, plane=wall.plane if k == 0 else None))
        expected = -float(np.dot(state.normal, np.cross(spin, [0.7, 0.0, 0.0])))
        assert k == 0 or state.rate == pytest.approx(expected, abs=1e-9)
        np.testing.assert_allclose(state.normal, wall.normal, atol=2e-3)  # carried by the gyro alone


# --------------------------------------------------------------------------------------------- touch and loss


class Press:
    """A still vehicle at a given tip distance whose sensor reads a given push at 100 Hz."""

    def __init__(self, config: ControllerConfig | None = None, seed: int = 0) -> None:
        self.estimator = ContactEstimator(config or ControllerConfig())
        self.rng, self.tick = np.random.default_rng(seed), 0

    @property
    def state(self) -> ContactState:
        """Result of the last tick."""
        return self.estimator.state

    def feel(self, push: float, distance: float, seconds: float, sigma: float = 0.0, **flight: float) -> int:
        """Number of touches within that time; ``flight`` may give `press` and the closing `speed` [m/s]."""
        touches, speed, press = 0, flight.get("speed", 0.0), bool(flight.get("press", False))
        for _ in range(round(seconds / 0.004)):
            stamp = (self.tick + 1) * TICK_NS
            sample = self.tick // 3 * 3
            if sample == self.tick:
                self.noise = self.rng.normal(0.0, sigma) if sigma else 0.0
            sensors = measured(
                self.tick,
                contact_wrench=np.array([-(push + self.noise), 0, 0, 0, 0, 0]),
                wrench_stamp_ns=(sample + 1) * TICK_NS,
                plane=Wall(LEVEL, distance).plane,
                plane_stamp_ns=stamp,
            )
            before = self.state.in_contact
            touches += self.estimator.measure(sensors, press).in_contact and not before
            self.tick, distance = self.tick + 1, distance - 0.004 * speed
        return touches


def test_touch_needs_force_and_nearness() -> None:
    far = Press()
    assert far.feel(5.0, 0.05, 1.0) == 0  # a gust or a bumped tool, five centimetres away
    near = Press()
    assert near.feel(0.0, 0.002, 1.0) == 0
    assert near.feel(0.3, 0.002, 1.0) == 0  # below the least force
    assert near.feel(3.0, 0.0, 0.5) == 1
    assert near.state.in_contact and near.state.push == pytest.approx(3.0, rel=0.01)


def test_a_push_that_stops_the_tip_before_the_seen_surface_is_a_touch_of_another_one() -> None:
    """Vision follows the wall 50 mm behind the board: the tip presses the board and the distance says 47 mm."""
    press = Press()
    press.feel(0.0, 0.047, 0.5, press=True)
    assert press.feel(4.0, 0.047, 0.5, press=True) == 1
    assert press.state.in_contact and press.state.distance == pytest.approx(0.0, abs=3e-3)
    assert press.estimator.surface_offset == pytest.approx(0.047, abs=3e-3)
    a, b, c, d = press.estimator.on_felt_surface(Wall(LEVEL, 0.047).plane)
    np.testing.assert_allclose((a, b, c, d), Wall(LEVEL, 0.0).plane, atol=0.02)
    press.feel(4.0, 0.047, 2.0, press=True)
    assert press.state.in_contact, "the planes of the wall go on"
    press.feel(4.0, -0.003, 0.5, press=True)  # vision finds the board
    assert press.state.in_contact and press.estimator.surface_offset == 0.0
    assert press.state.distance == pytest.approx(-0.003, abs=1e-3)


def test_a_distance_that_starts_anew_in_a_contact_does_not_end_it() -> None:
    press = Press()
    press.feel(0.0, 0.005, 0.5, press=True)
    press.feel(5.0, -0.002, 2.0, press=True)
    assert press.state.in_contact
    press.estimator.doubt()  # ticks are missing, and the first plane after them is the wall's
    press.feel(5.0, 0.047, 0.004, press=True)
    assert press.state.in_contact and press.state.distance == pytest.approx(0.0, abs=1e-3)
    press.feel(5.0, 0.047, 2.0, press=True)
    assert press.state.in_contact and press.state.time_since_touch > 3.9


def test_a_false_force_makes_no_contact_far_from_the_wall() -> None:
    """The tip moves, or is not to press, or leaves a wall that it has touched: the force is the sensor's own."""
    moving = Press()
    moving.feel(0.0, 0.10, 0.5, press=True)
    moving.feel(0.0, 0.10, 0.2, press=True, speed=0.04)
    assert moving.feel(4.0, 0.092, 1.5, press=True, speed=0.04) == 0
    waiting = Press()
    waiting.feel(0.0, 0.06, 0.5)
    assert waiting.feel(4.0, 0.06, 3.0) == 0
    drifting = Press()
    drifting.feel(0.0, 0.005, 0.5, press=True)
    assert drifting.feel(5.0, -0.002, 1.0, press=True) == 1
    assert drifting.feel(5.0, -0.002, 4.0, press=True, speed=-0.005) == 0
    assert not drifting.state.in_contact and drifting.estimator.surface_offset == 0.0


def test_one_spike_is_no_touch() -> None:
    press = Press()
    press.feel(0.0, 0.002, 0.5)
    assert press.feel(2.0, 0.002, 0.012) == 0
    assert press.feel(0.0, 0.002, 0.3) == 0


@pytest.mark.parametrize("sigma", [1.0, 2.0, 3.0])
def test_noise_of_the_sensor_raises_the_threshold_instead_of_touching(sigma: float) -> None:
    press = Press(seed=int(sigma))
    press.feel(0.0, 0.10, 6.0, sigma)  # learns its noise in free flight
    spread = press.state.push_noise
    assert press.estimator.touch_threshold >= 3.0 * spread - 1e-9
    false_touches = press.feel(0.0, 0.004, 5.0, sigma)
    print(f"sigma {sigma} N: threshold {press.estimator.touch_threshold:.2f} N, {false_touches} false touches in 5 s")
    assert false_touches <= 1
    assert press.feel(press.estimator.touch_threshold * 2.0 + sigma, 0.0, 1.0, sigma) + false_touches >= 1


def test_loss_by_force_takes_its_time_and_by_distance_none() -> None:
    press = Press()
    press.feel(3.0, 0.0, 0.5)
    settings = ContactSettings()
    press.feel(0.0, 0.0, 0.03)
    assert press.state.in_contact  # the filter still holds some of the push
    press.feel(0.0, 0.0, settings.loss_time_s + 0.15)
    assert not press.state.in_contact and press.state.ramp == 0.0 and press.state.contact_weight == 0.0
    press.feel(3.0, 0.0, 0.5)
    assert press.state.in_contact
    press.feel(3.0, 0.03, 1.0)  # still a push on the sensor, but the wall is gone
    assert not press.state.in_contact


def test_a_dip_shorter_than_the_doubt_is_forgiven() -> None:
    press = Press()
    press.feel(3.0, 0.0, 1.5)
    ramp = press.state.ramp
    press.feel(0.0, 0.0, 0.06)
    press.feel(3.0, 0.0, 0.2)
    assert press.state.in_contact and press.state.ramp >= ramp


def test_ramp_rises_from_touch_and_can_be_switched_off() -> None:
    press = Press()
    press.feel(3.0, 0.0, 0.1)
    ramps = []
    for _ in range(300):
        press.feel(3.0, 0.0, 0.004)
        ramps.append(press.state.ramp)
    assert (np.diff(ramps) >= 0).all() and ramps[0] < 0.3 and ramps[-1] == 1.0
    bare = Press(ControllerConfig(touch_ramp=False))
    bare.feel(0.0, 0.002, 0.1)
    assert bare.state.ramp == 1.0


def test_a_stamp_far_ahead_does_not_end_the_ramp() -> None:
    press = Press()
    press.feel(3.0, 0.0, 0.1)
    ramp = press.state.ramp
    press.tick += round(10.0 / 0.004)  # a clock that jumps by ten seconds
    press.feel(3.0, 0.0, 0.004)
    assert press.state.in_contact and ramp < press.state.ramp < 0.5


@pytest.mark.slow
def test_lambda_falls_from_one_to_zero_with_depth() -> None:
    config = ControllerConfig(touch_ramp=False)
    settings, weights = config.contact, []
    for distance in np.linspace(-0.01, 0.25, 60):
        press = Press(config)
        press.feel(0.0, distance, 0.004)
        depth = press.state.depth
        assert depth == pytest.approx(0.5 + distance, abs=1e-9)
        weight = press.state.contact_weight
        assert 0.0 <= weight <= 1.0
        assert weight == 1.0 if depth <= settings.depth_min_m else True
        assert weight == 0.0 if depth >= settings.depth_max_m else True
        weights.append(weight)
    assert (np.diff(weights) <= 0).all() and weights[0] == 1.0 and weights[-1] == 0.0


def test_a_wrong_plane_is_believed_slowly_and_an_absurd_one_not_at_all() -> None:
    press = Press()
    press.feel(0.0, 0.2, 2.0)
    before = press.state.distance
    press.feel(0.0, 1.2, 0.004)
    assert press.state.distance == pytest.approx(before, abs=1e-3)
    press.feel(0.0, 0.23, 0.004)
    assert abs(press.state.distance - before) < 0.01


def test_a_wrong_first_plane_does_not_lock_out_the_right_ones() -> None:
    press = Press()
    press.feel(0.0, 1.2, 0.004)
    press.feel(0.0, 0.2, 3.0)
    assert press.state.distance == pytest.approx(0.2, abs=2e-3)
