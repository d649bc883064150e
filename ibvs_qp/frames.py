"""The frames and signs of the whole project, stated once.

- World I: north-east-down. Body B: front-right-down at the centre of mass. Camera C: right-down-front.
  End effector E: right-up-backward at the brush tip. SI units; quaternions are (w, x, y, z).
- A twist is [V; Omega] and a wrench [F; M]. The contact wrench acts ON the vehicle: a push on the wall is -x there.
  The push force f is > 0 when the brush presses the wall. ``n`` is the unit vector INTO the wall, in B.
- A line is x cos(theta) + y sin(theta) = rho in NORMALISED image coordinates; (rho, theta) and (-rho, theta + pi)
  are one line, so no sign is canonical: `align_line` takes the one whose normal agrees with a reference.
- The wall is 1/Z = a x + b y + c, i.e. the plane (A, B, C, D) = (a, b, c, -1) in C.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vectors import down_row, rotation_rows

#: Standard gravity [m/s^2].
GRAVITY = 9.81

#: Rotation that takes camera coordinates (right, down, front) to body coordinates (front, right, down).
R_BODY_CAMERA = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def skew(vector: np.ndarray) -> np.ndarray:
    """Cross-product matrix: ``skew(a) @ b == cross(a, b)``, shape (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of two 3-vectors, (3,).

    Written out because it runs many times per tick: numpy's general one costs twenty times as much.
    """
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def rotation_from_quaternion(quaternion: np.ndarray) -> np.ndarray:
    """Rotation matrix of a unit quaternion (w, x, y, z), shape (3, 3); B to I for an attitude.

    Written out because it runs every tick: scipy's Rotation object costs ten times as much for one quaternion.
    """
    return np.array(rotation_rows(*(float(entry) for entry in quaternion)))


def down_in_body(quaternion: np.ndarray) -> tuple[float, float, float]:
    """Unit vector of gravity (world down) in the body frame: the third row of the rotation B to I."""
    return down_row(*quaternion.tolist())


def roll_pitch(quaternion: np.ndarray) -> tuple[float, float]:
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


def align_line(rho: float, theta: float, theta_reference: float) -> tuple[float, float]:
    """The sign of a line whose normal has a positive dot product with the reference's normal.

    Returns:
        (rho, theta) with theta within pi/2 of the reference, so that nothing jumps at any seam.
    """
    error = math.remainder(theta - theta_reference, 2.0 * math.pi)
    if abs(error) > 0.5 * math.pi:
        rho, error = -rho, math.remainder(error - math.pi, 2.0 * math.pi)
    return rho, theta_reference + error
