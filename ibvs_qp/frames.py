"""The frames and signs of the whole project, stated once.

- World I: north-east-down. Body B: front-right-down at the centre of mass. Camera C: right-down-front.
  End effector E: right-up-backward at the brush tip. SI units; quaternions are (w, x, y, z).
- A twist is [V; Omega] and a wrench [F; M]. The contact wrench acts ON the vehicle: a push on the wall is -x there.
  The push force f is > 0 when the brush presses the wall. ``n`` is the unit vector INTO the wall, in B.
- A line is x cos(theta) + y sin(theta) = rho in NORMALISED image coordinates; (rho, theta) and (-rho, theta + pi)
  are one line, so no sign is canonical: `align_line` takes the one whose normal agrees with a reference.
- The wall is 1/Z = a x + b y + c, i.e. the plane (A, B, C, D) = (a, b, c, -1) in C.

Functions on `Vector3` compute with plain floats: they run several times per tick, where numpy's overhead on arrays of
three costs ten times the arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from ibvs_qp.quaternion import from_rotation_vector

#: Standard gravity [m/s^2].
GRAVITY = 9.81

#: Rotation that takes camera coordinates (right, down, front) to body coordinates (front, right, down).
R_BODY_CAMERA = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])

Vector3 = tuple[float, float, float]
#: Rows of a rotation matrix.
Rotation3 = tuple[Vector3, Vector3, Vector3]


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """Scalar product of two 3-vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[float], b: Sequence[float]) -> Vector3:
    """Cross product a x b of two 3-vectors."""
    (ax, ay, az), (bx, by, bz) = a, b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def add_scaled(a: Sequence[float], scale: float, b: Sequence[float]) -> Vector3:
    """A + scale b of two 3-vectors."""
    (ax, ay, az), (bx, by, bz) = a, b
    return ax + scale * bx, ay + scale * by, az + scale * bz


def unit(vector: Sequence[float]) -> Vector3:
    """A 3-vector divided by its length."""
    x, y, z = vector
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def ordered_product(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """``matrix @ vector`` with sums in the order of the columns, as in C: a BLAS adds in an order of its own."""
    return np.multiply(matrix.T, vector[:, None], order="C").sum(axis=0)


def skew(vector: np.ndarray) -> np.ndarray:
    """Cross-product matrix: ``skew(a) @ b == cross(a, b)``, shape (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation_rows(w: float, x: float, y: float, z: float) -> Rotation3:
    """Rows of the rotation matrix of a unit quaternion; B to I for an attitude."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def rotate(rotation: Rotation3, vector: Sequence[float]) -> Vector3:
    """R v for a rotation given by its rows."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def rotate_back(rotation: Rotation3, vector: Sequence[float]) -> Vector3:
    """R' v for a rotation given by its rows."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z


def rotation_from_quaternion(quaternion: Iterable[float]) -> np.ndarray:
    """Rotation matrix of a unit quaternion (w, x, y, z), shape (3, 3); B to I for an attitude."""
    return np.array(rotation_rows(*map(float, quaternion)))


def rotation_from_vector(vector: Sequence[float] | np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector (axis times angle [rad]), shape (3, 3)."""
    return rotation_from_quaternion(from_rotation_vector(vector))


def down_in_body(quaternion: Iterable[float]) -> Vector3:
    """Unit vector of gravity (world down) in the body frame: the third row of the rotation B to I."""
    w, x, y, z = map(float, quaternion)
    return 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


def roll_pitch(quaternion: Iterable[float]) -> tuple[float, float]:
    """Roll and pitch of an attitude [rad] (Tait-Bryan z-y-x), independent of its arbitrary yaw."""
    gx, gy, gz = down_in_body(quaternion)
    return math.atan2(gy, gz), math.asin(max(-1.0, min(1.0, -gx)))


def camera_twist_matrix(camera_position: np.ndarray) -> np.ndarray:
    r"""Map T from body twist to camera twist: :math:`v_C = R^T (V + \Omega \times p)`, :math:`\omega_C = R^T \Omega`.

    Args:
        camera_position: Camera centre in the body frame [m], shape (3,).

    Returns:
        Matrix of shape (6, 6).
    """
    rotation = R_BODY_CAMERA.T
    upper = np.hstack((rotation, -rotation @ skew(np.asarray(camera_position, float))))
    return np.vstack((upper, np.hstack((np.zeros((3, 3)), rotation))))


def to_camera(point_body: np.ndarray, camera_position: np.ndarray) -> np.ndarray:
    """Coordinates of a body-frame point in the camera frame [m], shape (3,)."""
    return R_BODY_CAMERA.T @ (np.asarray(point_body, float) - np.asarray(camera_position, float))


def plane_in_body(plane: Sequence[float], point_from_camera: Sequence[float]) -> tuple[Vector3, float]:
    """Wall normal in B and distance of a point from the wall.

    Args:
        plane: (A, B, C, D) in C.
        point_from_camera: The point relative to the camera centre, in B axes [m], (3,).

    Returns:
        Unit vector into the wall, and the distance along it from the point to the wall [m].
    """
    a, b, c, d = plane
    scaled = -c / d, -a / d, -b / d  # camera axes (right, down, front) to body axes (front, right, down)
    length = math.sqrt(dot(scaled, scaled))
    return unit(scaled), (1.0 - dot(scaled, point_from_camera)) / length


def align_line(rho: float, theta: float, theta_reference: float) -> tuple[float, float]:
    """The sign of a line whose normal has a positive dot product with the reference's normal.

    Returns:
        (rho, theta) with theta within pi/2 of the reference, so that nothing jumps at any seam.
    """
    error = math.remainder(theta - theta_reference, 2.0 * math.pi)
    if abs(error) > 0.5 * math.pi:
        rho, error = -rho, math.remainder(error - math.pi, 2.0 * math.pi)
    return rho, theta_reference + error
