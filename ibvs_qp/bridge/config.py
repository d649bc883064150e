"""Settings of the bridge, and their TOML file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ibvs_qp.adapters.thrust_curve import ThrustCurve
from ibvs_qp.config.settings import choice, load_toml, setting, validate
from ibvs_qp.ros.messages import IMU, SENSOR_COMBINED, VEHICLE_ATTITUDE
from ibvs_qp.ros.topics import Px4Topics


@dataclass(frozen=True, kw_only=True)
class BridgeConfig:
    """What the bridge reads and writes, and when it stops."""

    topics: Px4Topics = field(default_factory=Px4Topics)
    imu_type: str = choice(SENSOR_COMBINED, "type of the topic imu", (SENSOR_COMBINED, IMU))
    attitude_type: str = choice(VEHICLE_ATTITUDE, "type of the topic attitude", (VEHICLE_ATTITUDE, IMU))
    output: str = choice(
        "motors", "ActuatorMotors, or VehicleThrustSetpoint and VehicleTorqueSetpoint", ("motors", "thrust_and_torque")
    )
    namespace: str = setting("", "prefix of PX4's topics, as /uav_1: option -n of PX4's uxrce_dds_client")
    domain_id: int = setting(0, "DDS domain, ROS_DOMAIN_ID", low=0, high=232)
    curve: ThrustCurve = field(default_factory=lambda: ThrustCurve(quadratic=0.0))
    link_timeout_s: float = setting(
        0.1,
        "inertial data older than this stop the bridge",
        unit="s",
        why="the pilot estimates them so long; with COM_OF_LOSS_T = 0.3 s PX4 takes over within 0.5 s",
        low=0.02,
        high=0.45,
    )
    sensor_timeout_s: float = setting(
        0.5, "oldest wrench and picture of a bridge that is ready", unit="s", low=0.05, high=5.0
    )
    mode_timeout_s: float = setting(
        1.5, "oldest VehicleControlMode; PX4 sends it twice a second and at changes", unit="s", low=0.5, high=10.0
    )
    check_s: float = setting(1.0, "self-check without a fault before the bridge is ready", unit="s", low=0.2, high=60.0)
    alive_hz: float = setting(20.0, "rate of OffboardControlMode; PX4 needs 2 Hz", unit="Hz", low=4.0, high=100.0)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)

    @classmethod
    def from_toml(cls, file: str | Path) -> BridgeConfig:
        """Read a file with these settings, [topics] and [curve]."""
        return load_toml(cls, file)
