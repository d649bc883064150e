"""Thrust and torque setpoints against PX4's allocation, written out as PX4 does it."""

from __future__ import annotations

import numpy as np
import pytest

from allocation import TAROT_T960, RotorGeometry, control_effectiveness
from ibvs_qp.adapters.px4 import setpoint_scale
from ibvs_qp.presets import preset


def px4_motors(geometry: RotorGeometry, coefficient: float, setpoint: np.ndarray) -> np.ndarray:
    """Motors of a setpoint (thrust, torque) by `ControlAllocationPseudoInverse`, entry by entry.

    PX4 orders axes roll, pitch, yaw, x, y, z.
    """
    effectiveness = coefficient * control_effectiveness(geometry)[[3, 4, 5, 0, 1, 2]]
    mix, motors = np.linalg.pinv(effectiveness), geometry.count
    scale = np.ones(6)
    rolling = [sum(abs(mix[i, axis]) > 1e-3 for i in range(motors)) for axis in (0, 1)]
    norms = [np.sqrt(sum(mix[:, axis] ** 2) / (count / 2)) for axis, count in enumerate(rolling)]
    scale[0] = scale[1] = max(norms)
    scale[2] = mix[:, 2].max()
    for axis in (2, 1, 0):
        column = [abs(mix[i, 3 + axis]) for i in range(motors)]
        used = sum(entry > np.finfo(np.float32).eps for entry in column)
        scale[3 + axis] = sum(column) / used if used else scale[5]
    mix = mix / scale
    mix[abs(mix) < 1e-3] = 0.0
    return mix @ setpoint[[3, 4, 5, 0, 1, 2]]


@pytest.mark.parametrize("geometry", [TAROT_T960, preset("octorotor_qp").controller.vehicle.geometry])
@pytest.mark.parametrize("coefficient", [52.56, 6.5])  # CT: PX4 needs only the ratios
def test_px4_commands_the_thrusts_of_the_wrench(geometry: RotorGeometry, coefficient: float) -> None:
    matrix = control_effectiveness(geometry)
    rng = np.random.default_rng(0)
    for _ in range(20):
        wrench = np.array([0.0, 0.0, -58.86, 0.0, 0.0, 0.0]) + rng.normal(0.0, [5, 5, 10, 1, 1, 0.5])
        motors = px4_motors(geometry, coefficient, setpoint_scale(geometry, 52.56) * wrench)
        np.testing.assert_allclose(matrix @ (52.56 * motors), wrench, atol=2e-2)


def test_hover_is_thrust_upwards_alone() -> None:
    setpoint = setpoint_scale(TAROT_T960, 52.56) * [0.0, 0.0, -58.86, 0.0, 0.0, 0.0]
    assert setpoint[2] == pytest.approx(-58.86 / (6 * 52.56 * np.cos(np.radians(30.0))), rel=1e-9)
