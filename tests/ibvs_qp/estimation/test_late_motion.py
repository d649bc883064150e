"""Lines, plane and velocity of a capture as they are now, against a camera that moved there."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from symbolic_block import Block

from ibvs_qp.estimation.motion_history import (
    MotionHistory,
    aligned,
    carried_line,
    carried_velocity,
    carried_wall,
    motion_since,
    rotation_from_vector,
)
from ibvs_qp.frames import R_BODY_CAMERA, align_line
from ibvs_qp.frames import rotation_from_vector as rotation

TICK_S, CAMERA = 0.004, np.array([0.15, 0.02, 0.05])
WALL_NORMAL, WALL_DISTANCE = np.array([0.98, 0.15, -0.1]), 0.6


def block() -> Block:
    """Line, wall and velocity at the present, (2 + 4 + 3,)."""

    def build(signals):
        rate, velocity = signals.input("rate", 3), signals.input("velocity", 3)
        acceleration = signals.input("acceleration", 3)
        history = MotionHistory(signals, signals.input("elapsed"), rate, acceleration, TICK_S, velocity)
        motion = motion_since(history, signals.input("age"))
        wall = carried_wall(signals.input("plane", 4), motion, ca.DM(CAMERA))
        line = carried_line(signals.input("rho"), signals.input("theta"), wall, motion, ca.DM(CAMERA))
        return ca.vertcat(*line, wall.normal, wall.distance, carried_velocity(velocity, motion))

    return Block(build)


class View:
    """What a camera sees from a pose: a line on the wall, and the wall."""

    def __init__(self, attitude: np.ndarray, position: np.ndarray) -> None:
        self._axes, self._centre = attitude @ R_BODY_CAMERA, position + attitude @ CAMERA

    def line(self, first: np.ndarray, second: np.ndarray) -> tuple[float, float]:
        normal = np.cross(*(self._axes.T @ (point - self._centre) for point in (first, second)))
        length = math.hypot(normal[0], normal[1])
        return -normal[2] / length, math.atan2(normal[1], normal[0])

    def plane(self) -> np.ndarray:
        distance = WALL_DISTANCE - WALL_NORMAL @ self._centre
        return np.append(self._axes.T @ WALL_NORMAL / distance, -1.0)


@given(seed=st.integers(0, 10_000), age_ticks=st.integers(1, 60), rate=st.floats(0.0, 0.4), speed=st.floats(0.0, 0.3))
@settings(max_examples=25, deadline=None)
def test_a_moved_camera_sees_what_is_computed(seed, age_ticks, rate, speed):
    random, carry = np.random.default_rng(seed), block()
    omega, in_world = rate * random.normal(size=3) / 2.0, speed * random.normal(size=3) / 2.0
    attitude, position, poses = np.eye(3), np.zeros(3), []
    for _ in range(120):
        attitude = attitude @ rotation(omega * TICK_S)
        position = position + TICK_S * in_world
        poses.append((attitude, position))
        carry(elapsed=TICK_S, rate=omega, velocity=attitude.T @ in_world, acceleration=0.0)
    now, then = View(*poses[-1]), View(*poses[-1 - age_ticks])
    offset = np.array([WALL_DISTANCE / WALL_NORMAL[0], 0.0, 0.0])
    along = np.cross(WALL_NORMAL, random.normal(size=3))
    ends = offset + 0.05 * along, offset - 0.3 * along
    rho, theta = then.line(*ends)
    step = carry.step  # the same tick again, with the late samples
    for name, value in {"age": age_ticks * TICK_S, "plane": then.plane(), "rho": rho, "theta": theta}.items():
        step.inputs[name][:] = value
    step.inputs["elapsed"][:] = 0.0
    step.evaluate()
    found = step.outputs["value"]
    moved = rate * age_ticks * TICK_S + speed * age_ticks * TICK_S
    assert (found[0], found[1]) == pytest.approx(align_line(*now.line(*ends), theta), abs=1e-4 + 0.05 * moved)
    plane = np.array(now.plane()[:3])  # per metre: an error of the distance counts with the square of the inverse depth
    assert found[2:5] / found[5] == pytest.approx(plane, abs=1e-4 + 0.05 * moved * np.linalg.norm(plane))


@given(vector=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3))
def test_rotations_are_those_of_frames(vector):
    assert np.array(ca.DM(rotation_from_vector(ca.SX(ca.DM(vector))))) == pytest.approx(rotation(vector), abs=1e-9)


@given(rho=st.floats(-2.0, 2.0), theta=st.floats(-7.0, 7.0), reference=st.floats(-4.0, 4.0))
def test_signs_are_aligned_as_in_frames(rho, theta, reference):
    error = abs(math.remainder(theta - reference, math.pi))
    if abs(error - 0.5 * math.pi) < 1e-6:
        return  # either sign
    found = [float(ca.DM(value)) for value in aligned(ca.SX(rho), ca.SX(theta), ca.SX(reference))]
    assert found == pytest.approx(align_line(rho, theta, reference), abs=1e-9)


def test_nothing_moves_without_motion():
    carry = block()
    inputs = {"elapsed": TICK_S, "rate": 0.0, "velocity": 0.0, "acceleration": 0.0}
    found = carry(**inputs, age=0.1, plane=(0.1, 0.0, 1.5, -1.0), rho=0.2, theta=3.0)
    assert found[:6] == pytest.approx([0.2, 3.0, 0.1, 0.0, 1.5, 1.0])
