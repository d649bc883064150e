"""Quantities derived from the logged motion, for all ticks at once: rotation, attitude angles, body velocity."""

from __future__ import annotations

import numpy as np

from ibvs_qp.frames import rotation_rows


def rotations(attitude: np.ndarray) -> np.ndarray:
    """Rotation matrices of unit quaternions (w, x, y, z): (N, 4) to (N, 3, 3)."""
    return np.moveaxis(np.array(rotation_rows(*attitude.T)), 2, 0)


def euler_angles(rotation: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw [rad] of rotations B to I: (N, 3, 3) to (N, 3)."""
    roll = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    pitch = np.arcsin(np.clip(-rotation[:, 2, 0], -1.0, 1.0))
    return np.column_stack((roll, pitch, np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])))


def in_body(rotation: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """World vectors in the body frame, R' v: (N, 3)."""
    return np.einsum("nji,nj->ni", rotation, vectors)
