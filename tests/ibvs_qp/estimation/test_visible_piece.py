"""The visible piece of a line on the wall, and painted edges that swing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import TICK_NS, Wall, attitude
from estimators import PlaneMotion, wall_line
from hypothesis import given, settings
from hypothesis import strategies as st

from ibvs_qp.config import EstimationConfig
from ibvs_qp.estimation.wall_lines import WallAxes
from ibvs_qp.estimation.wall_motion import VELOCITY
from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, FeatureFrame

LEVEL = attitude()
TICK = 0.004
angle = st.floats(-0.25, 0.25)


def axes_of(wall: Wall) -> WallAxes:
    return WallAxes.of(wall.normal, wall.gravity)


@pytest.mark.slow
@settings(max_examples=200, deadline=None, derandomize=True)
@given(angle, angle, angle, angle, st.floats(-0.02, 0.5), st.floats(-0.2, 0.2), st.floats(-0.15, 0.15), st.booleans())
def test_middle_and_length_of_the_visible_piece(
    roll: float, pitch: float, turn: float, slope: float, distance: float, offset: float, along: float, level: bool
) -> None:
    """Two points on the wall, 0.2 m apart, to the image and back: the middle counts from the foot of the tip."""
    wall = Wall(attitude(roll, pitch), distance, turn)
    role, tilt = (HORIZONTAL, slope + 0.5 * math.pi) if level else (VERTICAL, slope)
    across = math.cos(tilt) * wall.right + math.sin(tilt) * wall.down
    direction = -math.sin(tilt) * wall.right + math.cos(tilt) * wall.down  # the normal, turned from right to down
    ends = [wall.foot + offset * across + (along + half) * direction for half in (-0.1, 0.1)]
    rays = [R_BODY_CAMERA.T @ (end - wall.camera) for end in ends]
    segment = np.array([ray[:2] / ray[2] for ray in rays])
    for flip in (False, True):
        for ordered in (segment, segment[::-1].copy()):
            line = replace(wall.line(offset, tilt, role, flip=flip), segment=ordered)
            found = wall_line(line, axes_of(wall), distance)
            assert (found["middle"], found["length"]) == pytest.approx((along, 0.2), abs=1e-9)


def test_the_middle_of_a_level_line_grows_to_the_left() -> None:
    """Its normal points down, and that turned from right to down by 90 degrees points left."""
    wall = Wall(LEVEL, 0.05)
    left = [wall.foot - right * wall.right + 0.05 * wall.down for right in (0.1, 0.2)]
    rays = [R_BODY_CAMERA.T @ (end - wall.camera) for end in left]
    line = replace(
        wall.line(0.05, 0.5 * math.pi, HORIZONTAL),
        segment=np.array([(ray[0] / ray[2], ray[1] / ray[2]) for ray in rays]),
    )
    assert wall_line(line, axes_of(wall), 0.05)["middle"] == pytest.approx(0.15)


def still_beside(kind: str, seconds: float, swing_m_s: float = 0.0, segment: np.ndarray | None = None) -> PlaneMotion:
    """A tip at rest beside a level line that moves to and fro at that speed, seen 60 ms late at 30 Hz."""
    wall, motion = Wall(LEVEL, 0.0), PlaneMotion()
    axes = axes_of(wall)
    for tick in range(1, round(seconds / TICK)):
        motion.predict(tick * TICK_NS, axes, np.array([0.0, 0.0, -9.81]), np.zeros(3), TICK, 0.0)
        if tick % 8 == 0 and tick > 15:
            offset = 0.05 + swing_m_s * math.sin(2.0 * math.pi * 0.3 * (tick - 15) * TICK) / (2.0 * math.pi * 0.3)
            fields = {"covariance": np.eye(2) * 1e-8, "track_id": 1, "kind": kind, "segment": segment}
            line = wall.line(offset, 0.5 * math.pi, HORIZONTAL, **fields)
            velocity, noise = np.zeros(3), np.eye(3) * 9e-6
            frame = FeatureFrame(
                lines=(line,),
                plane=wall.plane,
                stamp_ns=(tick - 15) * TICK_NS,
                velocity=velocity,
                velocity_covariance=noise,
            )
            motion.see(frame, axes, 0.0)
    return motion


def test_a_tracked_line_carries_the_piece_of_its_last_frame() -> None:
    wall = Wall(LEVEL, 0.0)
    ends = [wall.foot + right * wall.right + 0.05 * wall.down for right in (-0.1, 0.2)]
    rays = [R_BODY_CAMERA.T @ (end - wall.camera) for end in ends]
    segment = np.array([ray[:2] / ray[2] for ray in rays])
    line = still_beside("board", 1.0, segment=segment).lines[1]
    assert line.length == pytest.approx(0.3, abs=1e-6) and line.middle == pytest.approx(-0.05, abs=1e-6)
    assert line.seen_angle == pytest.approx(0.5 * math.pi) and line.seen_offset == pytest.approx(0.05, abs=1e-6)


def test_a_line_without_end_points_has_no_middle() -> None:
    line = still_beside("board", 1.0).lines[1]
    assert math.isnan(line.middle) and line.length == 0.0


def test_a_painted_edge_that_swings_says_less_of_the_velocity_than_a_board_s() -> None:
    """The tip is at rest: what a swinging edge adds to the velocity is an error."""
    worst = {}
    for kind in ("board", "paint"):
        errors = [abs(still_beside(kind, 3.0 + 0.3 * k, 5e-3).state[VELOCITY][1]) for k in range(10)]
        worst[kind] = max(errors)
    print({kind: f"{error * 1e3:.2f} mm/s" for kind, error in worst.items()})
    assert worst["paint"] < 0.6 * worst["board"]
    config = EstimationConfig()
    assert config.paint_noise > config.line_noise
