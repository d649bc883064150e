"""Conversion between the project's frames (NED, FRD) and MuJoCo's (z up, front-left-up).

Both pairs differ by the same half turn about x, S = diag(1, -1, -1), which is its own inverse and a rotation:
it maps forces and moments alike.
"""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import mujoco
import numpy as np

from allocation.geometry import perpendicular

#: Diagonal of S; multiply a vector (..., 3) by it to change sides.
FLIP = np.array([1.0, -1.0, -1.0])

#: The same for a quaternion (w, x, y, z).
FLIP_QUATERNION = np.array([1.0, 1.0, -1.0, -1.0])


def quaternion_of_axes(columns: np.ndarray) -> np.ndarray:
    """Quaternion (w, x, y, z) of the frame whose axes are the columns of a rotation matrix (3, 3)."""
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(columns).ravel())
    return quaternion


def rotor_quaternion(axis: np.ndarray) -> np.ndarray:
    """Quaternion (w, x, y, z) in MuJoCo's body frame of a rotor whose z is the thrust axis, given in FRD, (3,)."""
    up = FLIP * axis
    side = perpendicular(up)
    return quaternion_of_axes(np.column_stack((np.cross(side, up), side, up)))
