"""The textbook allocation: pseudo-inverse, then clipping to the thrust limits."""

from __future__ import annotations

import numpy as np

from allocation.effectiveness import as_matrix
from allocation.geometry import RotorGeometry


def allocate_pseudo_inverse(
    wrench: np.ndarray, rotors: RotorGeometry | np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    r"""Smallest thrusts of the desired wrench, :math:`u = B^+ w`, clipped to lower <= u <= upper.

    Clipping has no priorities: a rotor raised to its idle limit adds undesired lift, roll, pitch and yaw.

    Args:
        wrench: Desired body wrench w, (6,) [N, N m].
        rotors: The rotors, or their matrix B of `control_effectiveness`, (6, n).
        lower: Smallest thrusts, (n,) [N].
        upper: Largest thrusts, (n,) [N].

    Returns:
        Clipped and unclipped thrusts, (n,) each [N].
    """
    unclipped = np.linalg.pinv(as_matrix(rotors)) @ np.asarray(wrench, float)
    return np.clip(unclipped, lower, upper), unclipped
