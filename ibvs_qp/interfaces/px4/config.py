"""Settings of the bridge, and their TOML file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.settings import Checked, choice, load_toml, setting, validate
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.interfaces.px4.thrust_curve import ThrustCurve
from ibvs_qp.interfaces.ros.messages import IMU, SENSOR_COMBINED, VEHICLE_ATTITUDE
from ibvs_qp.interfaces.ros.topics import Px4Topics, check_name


@dataclass(frozen=True, kw_only=True)
class RotorCurve(Checked):
    """Thrust of every rotor over its command, at full voltage."""

    thrust_max_n: float | None = setting(
        None, "thrust at full command; without it the vehicle's thrust_max_n", unit="N", low=0.1, high=1000.0
    )
    quadratic: float = setting(0.0, "fraction of the quadratic term without PX4's THR_MDL_FAC", low=0.0, high=1.0)

    def of(self, vehicle: VehicleParams) -> ThrustCurve:
        """Curve of a vehicle's rotors.

        Raises:
            ConfigError: When a rotor has more thrust than at full command, or rotors differ and it is not given.
        """
        least, largest = float(np.min(vehicle.thrust_max)), float(np.max(vehicle.thrust_max))
        if self.thrust_max_n is None and least < largest:
            raise out_of_range("curve.thrust_max_n", None, "N", "it is needed for rotors of different thrust_max_n")
        full = largest if self.thrust_max_n is None else self.thrust_max_n
        if full < largest:
            raise out_of_range("curve.thrust_max_n", full, "N", f"at least {largest:g} N, the vehicle's thrust_max_n")
        return ThrustCurve(thrust_max_n=full, quadratic=self.quadratic)


@dataclass(frozen=True, kw_only=True)
class BridgeConfig:
    """Inputs and outputs of the bridge, and its stop conditions."""

    topics: Px4Topics = field(default_factory=Px4Topics)
    imu_type: str = choice(SENSOR_COMBINED, "type of the topic imu", (SENSOR_COMBINED, IMU))
    attitude_type: str = choice(VEHICLE_ATTITUDE, "type of the topic attitude", (VEHICLE_ATTITUDE, IMU))
    output: str = choice(
        "motors", "ActuatorMotors, or VehicleThrustSetpoint and VehicleTorqueSetpoint", ("motors", "thrust_and_torque")
    )
    namespace: str = setting("", "prefix of PX4's topics, as /uav_1: option -n of PX4's uxrce_dds_client")
    domain_id: int = setting(0, "DDS domain, ROS_DOMAIN_ID", low=0, high=232)
    curve: RotorCurve = field(default_factory=RotorCurve)
    link_timeout_s: float = setting(
        0.1,
        "inertial data older than this, by arrival or stamp, stop the bridge",
        unit="s",
        why="the pilot estimates them so long; with COM_OF_LOSS_T = 0.3 s PX4 takes over within 0.5 s",
        low=0.02,
        high=0.45,
    )
    sensor_timeout_s: float = setting(
        0.5, "oldest wrench and picture of a bridge that is ready", unit="s", low=0.05, high=5.0
    )
    mode_timeout_s: float = setting(
        0.7,
        "oldest VehicleControlMode: the longest time that setpoints go on after PX4 left Offboard mode unseen",
        unit="s",
        why="PX4 sends it every 0.5 s and at changes",
        low=0.5,
        high=10.0,
    )
    check_s: float = setting(1.0, "self-check without a fault before the bridge is ready", unit="s", low=0.2, high=60.0)
    alive_hz: float = setting(20.0, "rate of OffboardControlMode; PX4 needs 2 Hz", unit="Hz", low=4.0, high=100.0)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
        if self.namespace:
            check_name("namespace", self.namespace)
        if not self.topics.color:
            raise out_of_range("topics.color", self.topics.color, "", "the bridge needs pictures")
        if self.topics.attitude_filter_s > 0.0:
            words = "it must be 0 in flight: PX4 has an attitude, and the self-check compares it with the accelerometer"
            raise out_of_range("topics.attitude_filter_s", self.topics.attitude_filter_s, "s", words)

    @classmethod
    def from_toml(cls, file: str | Path) -> BridgeConfig:
        """Read a file with these settings, [topics] and [curve]."""
        return load_toml(cls, file)
