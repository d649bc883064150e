"""Messages that the bridge sends: proof of life, and motors or thrust and torque."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ibvs_qp.command import Command
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.interfaces.px4.config import BridgeConfig
from ibvs_qp.interfaces.px4.rotors import MOST_PX4_ROTORS, setpoint_scale
from ibvs_qp.interfaces.ros.messages import message, to_px4

OFFBOARD_TOPIC, OFFBOARD_MODE = "/fmu/in/offboard_control_mode", "px4_msgs/msg/OffboardControlMode"
#: Topics and types of the two kinds of setpoints.
SETPOINTS = {
    "motors": {"/fmu/in/actuator_motors": "px4_msgs/msg/ActuatorMotors"},
    "thrust_and_torque": {
        "/fmu/in/vehicle_thrust_setpoint": "px4_msgs/msg/VehicleThrustSetpoint",
        "/fmu/in/vehicle_torque_setpoint": "px4_msgs/msg/VehicleTorqueSetpoint",
    },
}
#: Flag of OffboardControlMode of each kind.
_FLAGS = {"motors": "direct_actuator", "thrust_and_torque": "thrust_and_torque"}


def publications(config: BridgeConfig) -> dict[str, str]:
    """Topics that the bridge writes, and their types."""
    topics = {OFFBOARD_TOPIC: OFFBOARD_MODE} | SETPOINTS[config.output]
    return {config.namespace + topic: name for topic, name in topics.items()}


class Outputs:
    """Builds the messages of one vehicle, by topic.

    Attributes:
        curve: Of its rotors.

    Args:
        config: Settings.
        vehicle: Its rotors are PX4's CA_ROTORn_*, in the same order.

    Raises:
        ConfigError: When PX4 does not support the number of rotors, or a thrust is beyond that of full command.
    """

    def __init__(self, config: BridgeConfig, vehicle: VehicleParams) -> None:
        self._config, self.curve = config, config.curve.of(vehicle)
        if vehicle.geometry.count > MOST_PX4_ROTORS:
            raise ConfigError(f"{vehicle.geometry.count} rotors are refused: PX4 has at most {MOST_PX4_ROTORS}")
        self._scale = setpoint_scale(vehicle.geometry, self.curve.thrust_max_n)

    def alive(self, now_ns: int) -> dict[str, Any]:
        """Proof of life, with the kind of the setpoints."""
        flag = {_FLAGS[self._config.output]: True}
        return {self._config.namespace + OFFBOARD_TOPIC: message(OFFBOARD_MODE, timestamp=to_px4(now_ns), **flag)}

    def setpoints(self, command: Command, sample_ns: int, now_ns: int) -> dict[str, Any]:
        """Messages of a command at the present time, and the time of the inertial data that it answers [ns]."""
        if self._config.output == "motors":
            control = np.full(MOST_PX4_ROTORS, math.nan, np.float32)  # NaN stops those that do not exist
            control[: len(command.thrusts)] = self.curve.commands(command.thrusts)
            values = [{"control": control}]
        else:
            setpoint = np.clip(self._scale * command.wrench, -1.0, 1.0).astype(np.float32)
            values = [{"xyz": setpoint[:3]}, {"xyz": setpoint[3:]}]
        times = {"timestamp": to_px4(now_ns), "timestamp_sample": to_px4(sample_ns)}
        return {
            self._config.namespace + topic: message(name, **times, **fields)
            for (topic, name), fields in zip(SETPOINTS[self._config.output].items(), values, strict=True)
        }
