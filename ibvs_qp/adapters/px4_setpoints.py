r"""Wrench to PX4's normalised thrust and torque setpoints.

PX4's pseudo-inverse allocation (`ControlAllocationPseudoInverse`) divides every column of the mixer
:math:`M = (B\,\mathrm{diag}(C_T))^+` by a scale s of its own, so the setpoint of a wrench w is :math:`s \odot w`:
PX4 then commands :math:`M w`, up to what it rounds to zero and what it limits.
"""

from __future__ import annotations

import numpy as np

from allocation import RotorGeometry, control_effectiveness

#: Entries of the mixer that PX4 counts for a torque, and for a thrust [-].
_LEAST_TORQUE, _LEAST_THRUST = 1e-3, float(np.finfo(np.float32).eps)


def setpoint_scale(geometry: RotorGeometry, thrust_max_n: float) -> np.ndarray:
    """Setpoint per wrench, for vehicles whose allocation PX4 normalises (multirotors): 1/N and 1/(N m), (6,).

    Args:
        geometry: Rotors, in the order of CA_ROTORn_*.
        thrust_max_n: Thrust of a rotor at full command [N], the same for all.

    Returns:
        Scales of (Fx, Fy, Fz, Mx, My, Mz) in FRD.
    """
    mixer = np.linalg.pinv(thrust_max_n * control_effectiveness(geometry))
    thrust, torque = np.abs(mixer[:, :3]), mixer[:, 3:]
    used = np.maximum((thrust > _LEAST_THRUST).sum(axis=0), 1)
    scale = np.where((thrust > _LEAST_THRUST).any(axis=0), thrust.sum(axis=0) / used, 0.0)
    scale = np.where(scale > 0.0, scale, scale[2])  # an axis without rotors has the scale of z
    rotors = (np.abs(torque[:, :2]) > _LEAST_TORQUE).sum(axis=0)
    level = np.sqrt((torque[:, :2] ** 2).sum(axis=0) / (np.maximum(rotors, 1) / 2.0))
    level = np.where(rotors > 0, level, 1.0).max()
    return np.array((*scale, level, level, torque[:, 2].max()))
