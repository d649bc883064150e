"""Rotor thrusts to body wrench: the linear map that every allocation method starts from."""

from __future__ import annotations

import numpy as np

from allocation.geometry import RotorGeometry


def control_effectiveness(geometry: RotorGeometry) -> np.ndarray:
    r"""Wrench of unit thrust of every rotor, at the centre of mass in the body frame (FRD).

    Column i is :math:`[t_i;\; p_i \times t_i - s_i K_{M,i} t_i]` with hub position p, thrust axis t, spin s
    (+1 counter-clockwise) and drag-torque ratio K_M of the rotor, the convention of PX4's rotor effectiveness.

    Args:
        geometry: The rotors.

    Returns:
        Matrix B of shape (6, n): force rows [-], moment rows [m].
    """
    axes, positions = geometry.axes, geometry.positions
    moments = np.cross(positions, axes) - (geometry.spins * geometry.torque_ratios)[:, None] * axes
    return np.vstack((axes.T, moments.T))


def as_matrix(rotors: RotorGeometry | np.ndarray) -> np.ndarray:
    """Control effectiveness B of shape (6, n), of a geometry or given as such."""
    return control_effectiveness(rotors) if isinstance(rotors, RotorGeometry) else np.asarray(rotors, float)
