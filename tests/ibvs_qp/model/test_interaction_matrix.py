"""The line interaction matrix against central differences through rigid motions of a real 3-D line."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from ibvs_qp.frames import align_line, skew
from ibvs_qp.vision import endpoint_line_row, line_interaction_matrix


def random_line(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, tuple[float, float, float, float]]:
    """Two points in front of the camera and a plane through them, D != 0."""
    first = np.array([*rng.uniform(-0.4, 0.4, 2), rng.uniform(0.4, 1.5)])
    second = first + rng.uniform(-0.5, 0.5, 3) * (1, 1, 0.3)
    normal = np.cross(second - first, rng.normal(size=3) * (1, 1, 0.2) + np.array([0.1, 0.2, 0.0]))
    normal /= np.linalg.norm(normal)
    return first, second, (*normal, -float(normal @ first))


def image_line(first: np.ndarray, second: np.ndarray, theta_reference: float) -> tuple[float, float]:
    """(rho, theta) of the image of the line through two points, sign as the reference's."""
    a, b, c = np.cross(first / first[2], second / second[2])
    return align_line(-c / math.hypot(a, b), math.atan2(b, a), theta_reference)


def moved(point: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Coordinates of a fixed point after the camera has moved along a twist in its own frame."""
    motion = np.zeros((4, 4))
    motion[:3, :3], motion[:3, 3] = skew(twist[3:]), twist[:3]
    return (expm(-motion) @ np.append(point, 1.0))[:3]


def numeric(first: np.ndarray, second: np.ndarray, theta: float, step: float = 1e-5) -> np.ndarray:
    columns = []
    for axis in np.eye(6):
        ahead = image_line(moved(first, step * axis), moved(second, step * axis), theta)
        behind = image_line(moved(first, -step * axis), moved(second, -step * axis), theta)
        columns.append((np.array(ahead) - behind) / (2 * step))
    return np.array(columns).T


def cases() -> list[tuple[np.ndarray, np.ndarray, tuple[float, float, float, float]]]:
    rng = np.random.default_rng(3)
    found = [random_line(rng) for _ in range(400)]
    return [case for case in found if abs(case[2][3]) > 0.1 and np.linalg.norm(np.cross(case[0], case[1])) > 0.05][:100]


def test_central_differences_for_both_signs_of_rho() -> None:
    negative = 0
    assert len(cases()) == 100
    for first, second, plane in cases():
        for reference in (0.3, 0.3 + math.pi):  # the same line written both ways
            rho, theta = image_line(first, second, reference)
            negative += rho < 0
            expected = numeric(first, second, theta)
            scale = max(1.0, float(np.abs(expected).max()))
            assert np.abs(line_interaction_matrix(rho, theta, plane) - expected).max() / scale < 1e-7
    assert negative == 100


def test_sign_flip_turns_the_rho_row_only() -> None:
    first, second, plane = cases()[0]
    rho, theta = image_line(first, second, 0.0)
    one, two = line_interaction_matrix(rho, theta, plane), line_interaction_matrix(-rho, theta + math.pi, plane)
    np.testing.assert_allclose(two, np.diag([-1.0, 1.0]) @ one, atol=1e-12)


@pytest.mark.parametrize("scale", [1e-6, 3.0, -1.0, 1e6])
def test_scale_and_sign_of_the_plane_do_not_matter(scale: float) -> None:
    _, _, plane = cases()[1]
    one = line_interaction_matrix(0.2, 1.4, plane)
    np.testing.assert_allclose(line_interaction_matrix(0.2, 1.4, tuple(scale * v for v in plane)), one, rtol=1e-12)


def test_known_rows() -> None:
    level = line_interaction_matrix(0.2, 0.5 * math.pi, (0.0, 0.0, 1.0, -1.0))
    np.testing.assert_allclose(level, [[0, -1, 0.2, 1.04, 0, 0], [0, 0, 0, 0, -0.2, -1]], atol=1e-15)
    upright = line_interaction_matrix(0.2, 0.0, (0.0, 0.0, 1.0 / 1.5, -1.0))
    np.testing.assert_allclose(upright, [[-1 / 1.5, 0, 0.2 / 1.5, 0, -1.04, 0], [0, 0, 0, -0.2, 0, -1]], atol=1e-15)


def test_camera_in_the_plane_is_refused() -> None:
    with pytest.raises(ValueError, match="D = 0"):
        line_interaction_matrix(0.1, 0.2, (1.0, 0.0, 0.0, 0.0))


def test_endpoint_row_is_the_rate_of_the_distance_from_an_image_point() -> None:
    tip = (0.03, -0.16)
    for first, second, plane in cases()[:20]:
        rho, theta = image_line(first, second, 0.3)
        row = endpoint_line_row(line_interaction_matrix(rho, theta, plane), theta, tip)
        for axis in range(6):
            twist = 1e-5 * np.eye(6)[axis]
            errors = []
            for sign in (1.0, -1.0):
                r, t = image_line(moved(first, sign * twist), moved(second, sign * twist), theta)
                errors.append(r - tip[0] * math.cos(t) - tip[1] * math.sin(t))
            assert abs((errors[0] - errors[1]) / 2e-5 - row[axis]) < 1e-6 * max(1.0, np.abs(row).max())
