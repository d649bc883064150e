"""Commands to PX4's messages."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from allocation import control_effectiveness
from ibvs_qp import Command, ConfigError, Outcome, VehicleParams
from ibvs_qp.interfaces.px4.config import BridgeConfig, RotorCurve
from ibvs_qp.interfaces.px4.outputs import Outputs, publications
from ibvs_qp.interfaces.ros.messages import encoded

VEHICLE = VehicleParams()
THRUSTS = np.array([1.2, 10.0, 20.0, 30.0, 40.0, 52.56])
COMMAND = Command(
    stamp_ns=1,
    thrusts=THRUSTS,
    wrench=control_effectiveness(VEHICLE.geometry) @ THRUSTS,
    outcome=Outcome.SOLVED,
    mode="free",
    unallocated_wrench=np.zeros(6),
)
NOW, SAMPLE = 5_004_999, 5_000_000  # ns


def motors(command: Command = COMMAND, vehicle: VehicleParams = VEHICLE, **curve: float) -> Any:
    config = BridgeConfig(curve=RotorCurve(**curve))
    ((topic, value),) = Outputs(config, vehicle).setpoints(command, SAMPLE, NOW).items()
    assert topic == "/fmu/in/actuator_motors"
    return value


def test_motors_in_px4s_order_with_thrust_as_share_of_full() -> None:
    value = motors()
    np.testing.assert_allclose(value.control[:6], THRUSTS / 52.56, rtol=1e-6)
    assert np.isnan(value.control[6:]).all() and value.control.shape == (12,) and value.reversible_flags == 0
    assert (value.timestamp, value.timestamp_sample) == (5004, 5000)


@pytest.mark.parametrize("quadratic", [0.0, 0.5])
def test_full_command_is_the_full_thrust_of_the_vehicle_at_hand(quadratic: float) -> None:
    weaker, command = (dataclasses.replace(VEHICLE, thrust_max_n=35.0), np.full(6, 35.0))
    value = motors(dataclasses.replace(COMMAND, thrusts=command), weaker, quadratic=quadratic)
    np.testing.assert_allclose(value.control[:6], 1.0, rtol=1e-6)


def test_the_curve_is_inverted_where_px4_does_not() -> None:
    u = motors(thrust_max_n=60.0, quadratic=0.7).control[:6].astype(float)
    np.testing.assert_allclose(60.0 * (0.7 * u**2 + 0.3 * u), THRUSTS, rtol=1e-5)


def test_thrust_and_torque_are_bounded() -> None:
    outputs = Outputs(BridgeConfig(output="thrust_and_torque"), VEHICLE)
    values = outputs.setpoints(dataclasses.replace(COMMAND, wrench=1e4 * COMMAND.wrench), SAMPLE, NOW)
    assert list(values) == ["/fmu/in/vehicle_thrust_setpoint", "/fmu/in/vehicle_torque_setpoint"]
    for value in values.values():
        assert (np.abs(value.xyz) <= 1.0).all() and value.xyz.dtype == np.float32


@pytest.mark.parametrize(("output", "field"), [("motors", "direct_actuator"), ("thrust_and_torque",) * 2])
def test_the_proof_of_life_names_the_kind(output: str, field: str) -> None:
    config = BridgeConfig(output=output, namespace="/uav_1")
    ((topic, value),) = Outputs(config, VEHICLE).alive(NOW).items()
    assert [name for name in vars(value) if getattr(value, name) is True] == [field] and value.timestamp == 5004
    names = publications(config)
    assert topic == "/uav_1/fmu/in/offboard_control_mode"
    assert all(name.startswith("/uav_1/fmu/in/") for name in names)
    encoded(value, names[topic])


def test_what_does_not_fit_the_vehicle_is_refused() -> None:
    unequal = dataclasses.replace(VEHICLE, thrust_max_n=(50.0, 50.0, 50.0, 50.0, 50.0, 40.0))
    with pytest.raises(ConfigError, match=r"curve.thrust_max_n = 40.0 N .* at least 52.56 N"):
        motors(thrust_max_n=40.0)
    with pytest.raises(ConfigError, match=r"curve.thrust_max_n = None N .* rotors of different thrust_max_n"):
        motors(vehicle=unequal)
    motors(vehicle=unequal, thrust_max_n=53.0)
    settings = {"output": "pwm", "domain_id": 233, "link_timeout_s": 0.5, "imu_type": "x"}
    for name, wrong in (*settings.items(), ("namespace", "uav_1"), ("namespace", "/uav_1/")):
        with pytest.raises(ConfigError, match=name):
            BridgeConfig(**{name: wrong})
