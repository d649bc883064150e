"""All estimates together: samples that count once, remembered attitudes, a wrench in place of the sensor's, resets."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from controller_scenes import TICK_NS, Wall, attitude

from ibvs_qp.config import ControllerConfig, EstimationConfig
from ibvs_qp.estimation.attitude import UNCERTAIN_BIAS
from ibvs_qp.estimation.estimator import INERTIAL, Estimator
from ibvs_qp.measurement import HORIZONTAL, FeatureFrame, SensorFrame

LEVEL, FORCE = attitude(), np.array([0.0, 0.0, -9.81])


class NoMotors:
    """Motors whose thrusts are not known."""

    def __init__(self) -> None:
        self.angular_acceleration = self.modelled_force = self.motors_force = [0.0, 0.0, 0.0]


class Hover:
    """A vehicle that turns to the right in front of a wall, seen 60 ms late."""

    def __init__(self, **settings: Any) -> None:
        self.estimator = Estimator(ControllerConfig(**settings), EstimationConfig())
        self.tick, self.rate, self.wrench = 0, np.array([0.0, 0.0, 0.1]), np.zeros(6)

    def step(self, missing: tuple[str, ...] = (), **changes: Any) -> None:
        """One tick, with whatever is to be different in the frame."""
        self.tick += 1
        now = attitude(yaw=0.1 * 0.004 * self.tick)
        frame = SensorFrame(
            stamp_ns=self.tick * TICK_NS,
            attitude=now,
            angular_velocity=self.rate,
            specific_force=FORCE,
            wrench=self.wrench,
            wrench_stamp_ns=self.tick * TICK_NS,
        )
        measured = {name: getattr(frame, name).tolist() for name in INERTIAL}
        wrench = changes.pop("in_place", None)
        frame = replace(frame, **changes)
        plane = Wall(now, 0.3).plane if self.tick % 8 == 0 else None
        given = {"plane": plane, "plane_ns": frame.stamp_ns, "wrench": wrench}
        self.estimator.predict(frame, measured, missing, motors=NoMotors(), **given)
        if self.tick % 8 == 0 and self.tick > 15:
            then = self.tick - 15
            wall = Wall(attitude(yaw=0.1 * 0.004 * then), 0.3)
            line = wall.line(0.05, 0.5 * np.pi, HORIZONTAL, covariance=1e-8 * np.eye(2), track_id=1)
            features = FeatureFrame(lines=(line,), plane=wall.plane, stamp_ns=then * TICK_NS)
            assert self.estimator.correct(features)


def flown(ticks: int = 300, **settings: Any) -> Hover:
    hover = Hover(**settings)
    for _ in range(ticks):
        hover.step()
    return hover


def results(hover: Hover) -> list[float]:
    found = hover.estimator
    line = found.motion.lines[1]
    return [*found.motion.state, *found.attitude, *found.wrench, found.contact.state.distance, line.angle, line.offset]


def test_old_and_broken_force_samples_change_nothing() -> None:
    hover = flown()
    assert hover.estimator.tared
    last = hover.estimator.wrench
    for changes in ({"wrench_stamp_ns": 4}, {"wrench": np.full(6, np.nan)}):
        hover.step(**({"wrench": 1e3 * np.ones(6)} | changes))
        assert hover.estimator.wrench == last
    hover.step(wrench=np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert hover.estimator.wrench[0] == pytest.approx(-3.0, abs=0.1)


def test_a_wrench_in_place_of_the_sensors_counts_at_its_own_time() -> None:
    hover, push = flown(), np.array([-5.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(25):
        hover.step(in_place=(push, (hover.tick + 1) * TICK_NS))
    assert hover.estimator.wrench == push.tolist() and hover.estimator.wrench_ns == hover.tick * TICK_NS
    assert hover.estimator.contact.state.push == pytest.approx(5.0, rel=0.1)


def test_attitude_rate_and_turn_of_a_past_time() -> None:
    hover = flown()
    then, now = (hover.tick - 50) * TICK_NS, hover.tick * TICK_NS
    np.testing.assert_allclose(
        hover.estimator.attitude_at(then), attitude(yaw=0.1 * 0.004 * (hover.tick - 50)), atol=1e-9
    )
    np.testing.assert_allclose(hover.estimator.turn(then, now), [0.0, 0.0, 0.1 * 50 * 0.004], atol=1e-12)
    np.testing.assert_allclose(hover.estimator.rate_at(then), hover.rate, atol=1e-6)


def test_the_bias_of_a_gyro_is_no_rotation() -> None:
    hover = flown()
    turn = hover.rate
    hover.rate = turn + np.radians([3.0, 3.0, -3.0])
    for _ in range(2000):
        hover.step()
    np.testing.assert_allclose(hover.estimator.rate, turn, atol=1.01 * UNCERTAIN_BIAS)
    np.testing.assert_allclose(hover.estimator.motion.state[:3], 0.0, atol=5e-3)


@pytest.mark.parametrize("missing", [("specific_force",), ("attitude",)])
def test_the_bias_stays_known_while_another_sensor_fails(missing: tuple[str, ...]) -> None:
    hover = flown()
    turn = hover.rate
    hover.rate = turn + np.radians([3.0, 3.0, -3.0])
    for _ in range(2000):
        hover.step()
    for _ in range(250):
        hover.step(missing=missing)
        np.testing.assert_allclose(hover.estimator.rate, turn, atol=1.1 * UNCERTAIN_BIAS)
    now = attitude(yaw=0.1 * 0.004 * hover.tick)
    assert abs(np.dot(hover.estimator.attitude, now)) == pytest.approx(1.0, abs=1e-4)


def test_a_gyro_that_fails_is_replaced_and_the_attitude_goes_on() -> None:
    hover = flown()
    for _ in range(100):
        hover.step(missing=("angular_velocity",))
    np.testing.assert_allclose(hover.estimator.rate, hover.rate, atol=2e-3)
    assert hover.estimator.attitude == attitude(yaw=0.1 * 0.004 * hover.tick).tolist() and not hover.estimator.lost


def test_after_doubt_the_velocity_is_unknown_until_the_next_picture() -> None:
    hover = flown()
    before = hover.estimator.motion.velocity_variance
    hover.estimator.doubt()
    assert hover.estimator.motion.velocity_variance > 30.0 * before
    for _ in range(100):
        hover.step()
    assert hover.estimator.motion.velocity_variance < 0.3  # a level line shows the velocity down alone


@pytest.mark.parametrize("backend", ["python", "compiled"])
def test_a_reset_and_either_backend_give_the_same_numbers(backend: str) -> None:
    config = ControllerConfig()
    hover = flown(solver=replace(config.solver, backend=backend))
    expected = results(flown())
    assert results(hover) == expected
    inertial = dict(zip(INERTIAL, ([1.0, 0.0, 0.0, 0.0], [0.0] * 3, [0.0] * 3), strict=True))
    hover.estimator.reset(inertial)
    hover.tick = 0
    for _ in range(300):
        hover.step()
    assert results(hover) == expected
