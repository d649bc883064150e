"""Frames and signs: rotations against scipy, twists against finite differences, lines over every seam."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ibvs_qp.frames import (
    R_BODY_CAMERA,
    align_line,
    camera_twist_matrix,
    cross,
    dot,
    down_in_body,
    plane_in_body,
    roll_pitch,
    rotate,
    rotate_back,
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_rows,
    skew,
    to_camera,
)
from ibvs_qp.quaternion import multiply, small_difference, small_turn, turned

angles = st.floats(-1.4, 1.4)
any_angle = st.floats(-20.0, 20.0)


def quaternion(yaw: float, pitch: float, roll: float) -> np.ndarray:
    x, y, z, w = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat()
    return np.array([w, x, y, z])


def test_camera_axes_are_right_down_front_of_the_body() -> None:
    right, down, front = R_BODY_CAMERA.T @ [0, 1, 0], R_BODY_CAMERA.T @ [0, 0, 1], R_BODY_CAMERA.T @ [1, 0, 0]
    np.testing.assert_array_equal([right, down, front], np.eye(3))
    assert np.linalg.det(R_BODY_CAMERA) == 1.0
    np.testing.assert_allclose(to_camera(np.array([0.7, 0.01, 0.0]), np.array([0.2, 0.0, 0.08])), [0.01, -0.08, 0.5])


@settings(deadline=None)
@given(any_angle, angles, angles)
def test_attitude_takes_body_to_world_and_w_comes_first(yaw: float, pitch: float, roll: float) -> None:
    q = quaternion(yaw, pitch, roll)
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    np.testing.assert_allclose(rotation_from_quaternion(q), expected, atol=1e-12)
    np.testing.assert_allclose(down_in_body(q), expected.T @ [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(roll_pitch(q), (roll, pitch), atol=1e-9)  # whatever the yaw
    np.testing.assert_allclose(rotation_from_quaternion(-q), expected, atol=1e-12)  # q and -q are one attitude


@settings(deadline=None)
@given(any_angle, angles, angles)
def test_rotation_of_one_vector_is_that_of_the_matrix(yaw: float, pitch: float, roll: float) -> None:
    q, vector = quaternion(yaw, pitch, roll), (0.3, -2.0, 1.1)
    rows, matrix = rotation_rows(*q.tolist()), rotation_from_quaternion(q)
    np.testing.assert_allclose(rotate(rows, vector), matrix @ vector, atol=1e-12)
    np.testing.assert_allclose(rotate_back(rows, vector), matrix.T @ vector, atol=1e-12)


def test_plane_in_body_is_normal_and_distance_of_a_point() -> None:
    """A wall 2 m from the camera, askew: it is 2 m from the camera and none from a point on it."""
    normal = np.array([math.cos(0.3), math.sin(0.3), 0.0])
    a, b, c = R_BODY_CAMERA.T @ normal / 2.0  # 1/Z = a x + b y + c for the points with n . P = 2
    found, distance = plane_in_body((a, b, c, -1.0), (0.0, 0.0, 0.0))
    np.testing.assert_allclose(found, normal, atol=1e-12)
    assert distance == pytest.approx(2.0)
    on_wall = 2.0 * normal + 0.7 * np.array([-math.sin(0.3), math.cos(0.3), 0.0]) + [0.0, 0.0, 0.4]
    assert plane_in_body((a, b, c, -1.0), on_wall.tolist())[1] == pytest.approx(0.0, abs=1e-12)


def test_signs_of_roll_pitch_and_yaw_are_ned() -> None:
    right_wing_down = rotation_from_quaternion(quaternion(0, 0, 0.1)) @ [0, 1, 0]
    assert right_wing_down[2] > 0
    assert (rotation_from_quaternion(quaternion(0, 0.1, 0)) @ [1, 0, 0])[2] < 0  # nose up
    assert (rotation_from_quaternion(quaternion(0.1, 0, 0)) @ [1, 0, 0])[1] > 0  # nose to the east


@settings(deadline=None)
@given(st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=6))
def test_cross_and_skew_agree_with_numpy(numbers: list[float]) -> None:
    a, b = np.array(numbers[:3]), np.array(numbers[3:])
    np.testing.assert_allclose(cross(a.tolist(), b.tolist()), np.cross(a, b), rtol=1e-12, atol=1e-9)
    assert dot(a.tolist(), b.tolist()) == pytest.approx(float(a @ b), rel=1e-9, abs=1e-6)
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b), rtol=1e-12, atol=1e-6)


def test_camera_twist_is_the_motion_of_the_camera() -> None:
    """A body that moves along a twist for a short time carries its camera along ``T @ twist``."""
    rng, step = np.random.default_rng(1), 1e-6
    for _ in range(20):
        camera, twist = rng.normal(size=3), rng.normal(size=6)
        turned = Rotation.from_rotvec(step * twist[3:]).as_matrix()
        back = Rotation.from_rotvec(-step * twist[3:]).as_matrix()
        ahead, behind = step * twist[:3] + turned @ camera, -step * twist[:3] + back @ camera
        linear = R_BODY_CAMERA.T @ (ahead - behind) / (2 * step)
        spin = (R_BODY_CAMERA.T @ turned @ R_BODY_CAMERA - R_BODY_CAMERA.T @ back @ R_BODY_CAMERA) / (2 * step)
        angular = [spin[2, 1], spin[0, 2], spin[1, 0]]
        np.testing.assert_allclose(camera_twist_matrix(camera) @ twist, [*linear, *angular], atol=1e-8)


@settings(deadline=None)
@given(st.floats(-1.0, 1.0), any_angle, any_angle)
def test_aligned_line_is_the_same_line_and_agrees_with_the_reference(rho: float, theta: float, seam: float) -> None:
    for sign in (0, 1):
        r, t = align_line(rho if sign == 0 else -rho, theta + sign * math.pi, seam)
        assert abs(t - seam) <= 0.5 * math.pi + 1e-9
        np.testing.assert_allclose(
            [r * math.cos(t), r * math.sin(t)], [rho * math.cos(theta), rho * math.sin(theta)], atol=1e-9
        )


@pytest.mark.parametrize("reference", [0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi, 7.0])
def test_a_line_that_turns_through_a_seam_never_jumps(reference: float) -> None:
    last = None
    for slope in np.linspace(-0.3, 0.3, 61):
        for theta in (reference + slope, reference + slope + math.pi, reference + slope - 3 * math.pi):
            sign = 1.0 if theta == reference + slope else -1.0
            rho, aligned = align_line(sign * 0.2, theta, reference)
            assert rho == 0.2
            assert aligned - reference == pytest.approx(slope, abs=1e-12)
        assert last is None or 0 < aligned - last < 0.02
        last = aligned


def test_a_rotation_vector_turns_about_its_axis() -> None:
    for vector in ([0.3, -0.2, 0.5], [0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [0.0, np.pi, 0.0]):
        np.testing.assert_allclose(rotation_from_vector(vector), Rotation.from_rotvec(vector).as_matrix(), atol=1e-12)
    assert np.array_equal(rotation_from_vector((0.0, 0.0, 0.0)), np.eye(3))


@settings(deadline=None)
@given(st.tuples(*[any_angle] * 3), st.tuples(*[st.floats(-0.02, 0.02)] * 3))
def test_quaternions_turn_as_rotations_do(vector: tuple[float, ...], small: tuple[float, ...]) -> None:
    first, step = Rotation.from_rotvec(vector), Rotation.from_rotvec(small)
    q, both = first.as_quat(scalar_first=True), (first * step).as_quat(scalar_first=True)
    for found in (multiply(q, small_turn(small)), turned(q, small)):
        assert abs(np.dot(found, both)) == pytest.approx(1.0, abs=1e-9)
    for sign in (1.0, -1.0):  # q and -q are one attitude
        np.testing.assert_allclose(small_difference(q, sign * both), small, atol=1e-5)
