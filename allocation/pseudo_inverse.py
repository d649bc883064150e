"""The textbook allocation: pseudo-inverse, then clipping to the thrust limits."""

from __future__ import annotations

import numpy as np

from allocation.effectiveness import control_effectiveness
from allocation.geometry import RotorGeometry


def allocate_pseudo_inverse(
    wrench: np.ndarray, rotors: RotorGeometry | np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    r"""Smallest thrusts with the wanted wrench, :math:`u = B^+ w`, clipped to lower <= u <= upper.

    Clipping keeps no priority: a rotor raised to its idle floor adds lift, roll, pitch and yaw that nobody wanted.

    Args:
        wrench: Wanted body wrench w, (6,) [N, N m].
        rotors: The rotors, or their matrix B of `control_effectiveness`, (6, n).
        lower: Smallest thrusts, (n,) [N].
        upper: Largest thrusts, (n,) [N].

    Returns:
        Clipped and unclipped thrusts, (n,) each [N].
    """
    matrix = control_effectiveness(rotors) if isinstance(rotors, RotorGeometry) else np.asarray(rotors, float)
    unclipped = np.linalg.pinv(matrix) @ np.asarray(wrench, float)
    return np.clip(unclipped, lower, upper), unclipped
