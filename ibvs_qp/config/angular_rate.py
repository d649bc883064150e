"""Settings of the estimates of attitude and angular velocity that steer roll, pitch and yaw."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class AngularRateSettings:
    """Estimates of attitude and angular velocity, and the lead against the motors' lag (docs/how_it_works/model.md)."""

    gyro_bandwidth_hz: float = setting(
        12.5,
        "the gyro counts below, the motors' model above; 1000 takes the gyro as it is",
        unit="Hz",
        low=0.5,
        high=1000.0,
    )
    attitude_bandwidth_hz: float = setting(
        8.0,
        "roll and pitch of the attitude estimate count below, the angular velocity above; 1000 takes them as they are",
        unit="Hz",
        low=0.5,
        high=1000.0,
    )
    lead_s: float = setting(
        0.04, "damping acts on the rate this far ahead: two thirds of the motors' lag", unit="s", low=0.0, high=0.1
    )

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
