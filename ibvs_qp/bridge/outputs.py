"""What the bridge sends: proof of life, and motors or thrust and torque."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ibvs_qp.adapters.px4 import MOST_PX4_ROTORS, setpoint_scale
from ibvs_qp.bridge.config import BridgeConfig
from ibvs_qp.bridge.dds import Participant
from ibvs_qp.command import Command
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.ros.messages import message
from ibvs_qp.ros.stamps import to_px4

OFFBOARD_MODE = "px4_msgs/msg/OffboardControlMode"
#: Topics and types of the two kinds of setpoints.
SETPOINTS = {
    "motors": {"/fmu/in/actuator_motors": "px4_msgs/msg/ActuatorMotors"},
    "thrust_and_torque": {
        "/fmu/in/vehicle_thrust_setpoint": "px4_msgs/msg/VehicleThrustSetpoint",
        "/fmu/in/vehicle_torque_setpoint": "px4_msgs/msg/VehicleTorqueSetpoint",
    },
}
#: Field of OffboardControlMode of each kind.
_FIELDS = ("position", "velocity", "acceleration", "attitude", "body_rate", "thrust_and_torque", "direct_actuator")
_FIELD = {"motors": "direct_actuator", "thrust_and_torque": "thrust_and_torque"}


def publications(config: BridgeConfig) -> dict[str, str]:
    """Topics that the bridge writes, and their types."""
    topics = {"/fmu/in/offboard_control_mode": OFFBOARD_MODE} | SETPOINTS[config.output]
    return {config.namespace + topic: name for topic, name in topics.items()}


class Outputs:
    """Builds the messages of one vehicle.

    Attributes:
        curve: Of its rotors.

    Args:
        config: Settings.
        vehicle: Its rotors are PX4's CA_ROTORn_*, in the same order.

    Raises:
        ConfigError: When PX4 has no such number of rotors, or a thrust is beyond that of full command.
    """

    def __init__(self, config: BridgeConfig, vehicle: VehicleParams) -> None:
        self._config, self.curve = config, config.curve.of(vehicle)
        if vehicle.geometry.count > MOST_PX4_ROTORS:
            raise ConfigError(f"{vehicle.geometry.count} rotors are refused: PX4 has at most {MOST_PX4_ROTORS}")
        self._scale = setpoint_scale(vehicle.geometry, self.curve.thrust_max_n)

    def alive(self, now_ns: int) -> Any:
        """Proof of life, with the kind of the setpoints."""
        flags = {name: name == _FIELD[self._config.output] for name in _FIELDS}
        return message(OFFBOARD_MODE, timestamp=to_px4(now_ns), **flags)

    def setpoints(self, command: Command, sample_ns: int, now_ns: int) -> dict[str, Any]:
        """Messages of a command by topic.

        Args:
            command: Thrusts [N], (n,), and wrench (6,), FRD.
            sample_ns: Time of the inertial data that the command answers.
            now_ns: Present time.
        """
        times = {"timestamp": to_px4(now_ns), "timestamp_sample": to_px4(sample_ns)}
        if self._config.output == "motors":
            control = np.full(MOST_PX4_ROTORS, math.nan, np.float32)  # NaN stops those that do not exist
            control[: len(command.thrusts)] = self.curve.commands(command.thrusts)
            values = [{"reversible_flags": 0, "control": control}]
        else:
            setpoint = np.clip(self._scale * command.wrench, -1.0, 1.0).astype(np.float32)
            values = [{"xyz": setpoint[:3]}, {"xyz": setpoint[3:]}]
        kinds = SETPOINTS[self._config.output].items()
        return {
            self._config.namespace + topic: message(name, **times, **fields)
            for (topic, name), fields in zip(kinds, values, strict=True)
        }


class Publisher:
    """Writes the messages to DDS."""

    def __init__(self, config: BridgeConfig, participant: Participant) -> None:
        self._alive_topic = f"{config.namespace}/fmu/in/offboard_control_mode"
        self._writers = {topic: participant.writer(topic, name) for topic, name in publications(config).items()}

    def alive(self, value: Any) -> None:
        """Write the proof of life."""
        self._writers[self._alive_topic].write(value)

    def setpoints(self, values: dict[str, Any]) -> None:
        """Write setpoints by topic."""
        for topic, value in values.items():
            self._writers[topic].write(value)
