"""Lines between image and wall, and their prediction from late pictures to now."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import TICK_NS, Wall, attitude
from estimators import TIP_FROM_CAMERA, PlaneMotion, wall_line
from hypothesis import given, settings
from hypothesis import strategies as st

from ibvs_qp.config import EstimationConfig
from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.estimation.wall_lines import WallAxes, image_line
from ibvs_qp.estimation.wall_motion import BIAS_STD, ODOMETER, VELOCITY, VELOCITY_STD
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, FeatureFrame, LineFeature

LEVEL = attitude()
TICK = 0.004
angle = st.floats(-0.25, 0.25)


def axes_of(wall: Wall) -> WallAxes:
    return WallAxes.of(wall.normal, wall.gravity)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(angle, angle, st.floats(-3.0, 3.0), angle, st.floats(-0.02, 0.5), st.floats(-0.2, 0.2), angle, st.booleans())
def test_wall_to_image_and_back(
    roll: float, pitch: float, yaw: float, turn: float, distance: float, offset: float, slope: float, level: bool
) -> None:
    wall = Wall(attitude(roll, pitch, yaw), distance, yaw + turn)
    axes, role = axes_of(wall), HORIZONTAL if level else VERTICAL
    tilt = slope + (0.5 * math.pi if level else 0.0)
    for flip in (False, True):
        seen = replace(wall.line(offset, tilt, role, flip=flip), surface_side=-1 if flip else 1)
        found = wall_line(seen, axes, distance)
        assert (found["offset"], found["angle"]) == pytest.approx((offset, tilt), abs=1e-9)
        assert found["surface_side"] == 1  # for the normal of the wall line, whatever the sign of the image line
    rho, theta, _ = image_line(offset, tilt, axes, TIP_FROM_CAMERA, distance)
    expected = wall.line(offset, tilt, role)
    sign = 1.0 if math.cos(theta - expected.theta) > 0 else -1.0
    assert sign * rho == pytest.approx(expected.rho, abs=1e-9)
    assert math.cos(theta - expected.theta) == pytest.approx(sign, abs=1e-12)


def test_signs_below_and_right_are_positive() -> None:
    wall = Wall(LEVEL, 0.05)
    below, left = wall.line(0.05, 0.5 * math.pi, HORIZONTAL), wall.line(-0.05, 0.0, VERTICAL)
    depth = 0.55
    assert below.rho == pytest.approx((0.05 - 0.08) / depth) and left.rho == pytest.approx(-0.05 / depth)


def test_metres_per_unit_of_rho() -> None:
    wall, step = Wall(attitude(0.05, 0.02), 0.1, 0.1), 1e-6
    axes = axes_of(wall)
    line = wall.line(0.03, 0.02, VERTICAL)
    here, there = (wall_line(replace(line, rho=line.rho + change), axes, 0.1) for change in (0.0, step))
    assert (there["offset"] - here["offset"]) / step == pytest.approx(here["scale"], rel=0.03)


# ------------------------------------------------------------------------------------------------------ prediction


class Stroke:
    """A tip that moves along a wall; late pictures of its lines, flow velocity, accelerometer with a bias."""

    def __init__(self, velocity: tuple[float, float], latency_s: float, noise: float = 0.0) -> None:
        self.wall, self.speed = Wall(LEVEL, 0.0), np.array(velocity)
        self.motion = PlaneMotion()
        self.axes = axes_of(self.wall)
        self.late, self.noise = round(latency_s / TICK), noise
        self.rng, self.tick = np.random.default_rng(0), 0
        self.tip, self.false_speed, self.flows = [np.zeros(2)], 0.0, True

    def speed_at(self, tick: int) -> np.ndarray:
        """From rest to speed between two and three seconds."""
        return self.speed * min(1.0, max(0.0, tick * TICK - 2.0))

    def offset(self, line: str, tick: int) -> float:
        """True offset of a line now: a level one 5 cm below the start, an upright one 30 cm to the left."""
        tip = self.tip[tick]
        return 0.05 - tip[1] if line == HORIZONTAL else -0.3 - tip[0]

    def fly(self, seconds: float, lines: tuple[str, ...] = (HORIZONTAL,)) -> None:
        for _ in range(round(seconds / TICK)):
            tick = self.tick
            gain = (self.speed_at(tick + 1) - self.speed_at(tick)) / TICK
            force = np.array([0.0, gain[0] + 0.03, gain[1] - 9.81 + 0.02])
            self.motion.predict((tick + 1) * TICK_NS, self.axes, force, np.zeros(3), TICK, 0.0)
            self.tip.append(self.tip[-1] + TICK * self.speed_at(tick))
            self.tick = tick = tick + 1
            if tick % 8 == 0 and tick > self.late:
                self.motion.see(self.picture(tick - self.late, lines), self.axes, 0.0)

    def picture(self, then: int, lines: tuple[str, ...]) -> FeatureFrame:
        found = []
        for identity, role in enumerate(lines):
            tilt = 0.5 * math.pi if role == HORIZONTAL else 0.0
            offset = self.offset(role, then) + self.rng.normal(0.0, self.noise)
            covariance = np.eye(2) * 1e-8
            found.append(self.wall.line(offset, tilt, role, covariance=covariance, track_id=identity + 1))
        right, down = self.speed_at(then) + self.rng.normal(0.0, 3e-3, 2) + [self.false_speed, 0.0]
        velocity = np.array(self.axes.right) * right + np.array(self.axes.down) * down
        return FeatureFrame(
            lines=tuple(found),
            plane=self.wall.plane,
            stamp_ns=then * TICK_NS,
            velocity=velocity if self.flows else None,
            velocity_covariance=np.eye(3) * 9e-6,
        )

    def error(self, identity: int, role: str) -> float:
        return abs(self.motion.lines[identity].offset - self.offset(role, self.tick))


@pytest.mark.parametrize("latency", [0.060, 0.100])
@pytest.mark.parametrize("velocity", [(-0.1, 0.0), (0.0, -0.1), (0.1, 0.05)])
def test_late_lines_are_predicted_to_the_present(latency: float, velocity: tuple[float, float]) -> None:
    """At 0.1 m/s a line 100 ms late is 10 mm out of place; its prediction is within half a millimetre."""
    stroke = Stroke(velocity, latency)
    stroke.fly(4.0, (HORIZONTAL, VERTICAL))
    errors = []
    for _ in range(100):
        stroke.fly(0.02, (HORIZONTAL, VERTICAL))
        errors.append([stroke.error(1, HORIZONTAL), stroke.error(2, VERTICAL)])
        now = stroke.motion.feature(stroke.motion.lines[1], stroke.axes, 0.0, stroke.tick * TICK_NS)
        assert now.rho == pytest.approx((stroke.motion.lines[1].offset - 0.08) / 0.5, abs=1e-9)
    worst = np.max(errors)
    print(f"{velocity} m/s, {latency * 1e3:.0f} ms late: worst {worst * 1e3:.2f} mm")
    assert worst < 5e-4


def test_velocity_and_odometer_are_those_of_the_tip() -> None:
    stroke = Stroke((-0.1, 0.02), 0.060)
    stroke.fly(6.0)
    np.testing.assert_allclose(stroke.motion.state[VELOCITY], [-0.1, 0.02], atol=3e-3)
    np.testing.assert_allclose(stroke.motion.state[ODOMETER], stroke.tip[stroke.tick], atol=5e-3)
    assert stroke.motion.velocity_age_s < 0.1


def test_lines_in_both_directions_give_the_velocity_of_a_plain_board() -> None:
    stroke = Stroke((-0.1, 0.02), 0.060)
    stroke.flows = False
    stroke.fly(6.0, (HORIZONTAL, VERTICAL))
    np.testing.assert_allclose(stroke.motion.state[VELOCITY], [-0.1, 0.02], atol=5e-3)
    assert stroke.motion.velocity_age_s < 0.1
    stroke.fly(3.0, (HORIZONTAL,))  # along a level line nothing is seen
    assert stroke.motion.velocity_age_s > 0.5
    stroke.fly(1.0, ())
    assert stroke.motion.velocity_age_s > 1.5


def test_a_velocity_that_disagrees_is_refused_and_restarts_the_filter_once_it_lasts() -> None:
    stroke = Stroke((0.0, 0.0), 0.060)
    stroke.fly(3.0)
    stroke.false_speed, longest = 0.3, EstimationConfig().refusal_s
    stroke.fly(longest - 0.1)
    assert abs(stroke.motion.state[0]) < 0.02, "refused"
    assert stroke.motion.refused_s == pytest.approx(longest - 0.1, abs=0.1)
    stroke.fly(0.3)
    assert stroke.motion.state[0] == pytest.approx(0.3, abs=0.02)
    assert stroke.motion.refused_s == 0.0 and stroke.motion.velocity_age_s < 0.1


@pytest.mark.parametrize("latency", [0.060, 0.100])
def test_a_line_that_appears_at_speed_enters_where_it_is_and_is_not_refused(latency: float) -> None:
    stroke = Stroke((-0.1, 0.0), latency)
    stroke.fly(4.0)
    entered = 0.0
    for _ in range(60):
        stroke.fly(TICK, (HORIZONTAL, VERTICAL))
        if 2 in stroke.motion.lines:
            assert stroke.error(2, VERTICAL) < 1e-3  # from its first tick on
            entered += 1
    assert entered > 40
    line = stroke.motion.lines[2]
    assert line.frames >= 4 and line.weight > 0.9


def test_weight_grows_with_frames_and_fades_without_news() -> None:
    stroke = Stroke((0.0, 0.0), 0.060)
    stroke.fly(0.100)
    weights = [stroke.motion.lines[1].weight]
    for _ in range(30):
        stroke.fly(TICK)
        weights.append(stroke.motion.lines[1].weight)
    assert (np.diff(weights) >= 0).all() and weights[0] < 1.0 and weights[-1] == 1.0
    fading = []
    for _ in range(150):
        stroke.fly(TICK, ())
        fading.append(stroke.motion.lines[1].weight if 1 in stroke.motion.lines else 0.0)
    assert (np.diff(fading) <= 0).all() and fading[10] == 1.0 and fading[-1] == 0.0
    assert not stroke.motion.lines


def test_a_track_that_jumps_is_refused_and_then_begun_anew() -> None:
    stroke = Stroke((0.0, 0.0), 0.060)
    stroke.fly(2.0)
    before = stroke.motion.lines[1].offset
    jumped = replace(stroke.wall.line(0.09, 0.5 * math.pi, HORIZONTAL, covariance=np.eye(2) * 1e-8), track_id=1)
    seen = []
    for k in range(6):
        stroke.fly(0.032, ())
        frame = FeatureFrame(lines=(jumped,), plane=None, stamp_ns=(stroke.tick - 15) * TICK_NS)
        stroke.motion.see(frame, stroke.axes, 0.0)
        if 1 in stroke.motion.lines:
            seen.append((k, stroke.motion.lines[1].offset))
    assert seen[0][1] == pytest.approx(before, abs=1e-3)  # one wild picture is not believed
    assert seen[-1][1] == pytest.approx(0.09, abs=1e-3)  # what stays is


def test_a_noisier_force_gives_the_camera_more_weight() -> None:
    axes = axes_of(Wall(LEVEL, 0.0))

    def believed(density: float) -> float:
        """Velocity after a second of hover, by a flow of 0.1 m/s to the right; before it one that weighs nothing."""
        motion = PlaneMotion()
        flow = 0.1 * np.array(axes.right)
        for k in range(251):
            stamp = (k + 1) * TICK_NS
            motion.predict(stamp, axes, (0.0, 0.0, -9.81), (0.0, 0.0, 0.0), TICK, density)
            if k in (0, 250):
                covariance = (0.01 if k else 1e6) * np.eye(3)
                seen = FeatureFrame(lines=(), plane=None, stamp_ns=stamp, velocity=flow, velocity_covariance=covariance)
                motion.see(seen, axes, 0.0)
        return motion.state[0]

    variance = VELOCITY_STD**2 + BIAS_STD**2
    for density in (0.0, 4e-3):
        gain = (variance + density) / (variance + density + 0.01)
        assert believed(density) == pytest.approx(0.1 * gain, rel=0.02)
    assert believed(1e-6) == believed(0.0)  # the noise of the settings is the least


def test_turning_moves_the_tip_and_not_the_lines() -> None:
    """Yaw of the body sweeps the tip sideways: the upright line goes the other way, the odometer with the tip."""
    motion, wall = PlaneMotion(), Wall(LEVEL, 0.0)
    axes = axes_of(wall)
    motion.predict(TICK_NS, axes, np.array([0, 0, -9.81]), np.zeros(3), TICK, 0.0)
    line = wall.line(-0.05, 0.0, VERTICAL, covariance=np.eye(2) * 1e-8, track_id=7)
    motion.see(FeatureFrame(lines=(line,), plane=None, stamp_ns=TICK_NS), axes, 0.0)
    start = motion.lines[7].offset
    for k in range(10):
        motion.predict((k + 2) * TICK_NS, axes, np.array([0, 0, -9.81]), np.array([0, 0, 0.1]), TICK, 0.0)
    assert motion.state[ODOMETER][0] == pytest.approx(0.7 * 0.1 * 10 * TICK, abs=1e-6)
    assert motion.lines[7].offset - start == pytest.approx(-0.7 * 0.1 * 10 * TICK, abs=1e-6)


def test_more_lines_than_slots_and_reset() -> None:
    motion, wall = PlaneMotion(), Wall(LEVEL, 0.0)
    axes = axes_of(wall)
    force = np.array([0.0, 0.0, -9.81])

    def run() -> list[float]:
        states = []
        for k in range(40):
            motion.predict((k + 1) * TICK_NS, axes, force, np.zeros(3), TICK, 0.0)
            lines: list[LineFeature] = [
                wall.line(0.01 * i, 0.5 * math.pi, HORIZONTAL, covariance=np.eye(2) * 1e-6, track_id=i + 1)
                for i in range(12)
            ]
            motion.see(FeatureFrame(lines=tuple(lines), plane=None, stamp_ns=(k + 1) * TICK_NS), axes, 0.0)
            states += [motion.lines[key].offset for key in sorted(motion.lines)]
        return states

    first = run()
    assert len(motion.lines) == 8 and all(isinstance(line, TrackedLine) for line in motion.lines.values())
    motion.reset()
    assert not motion.lines
    assert run() == first
