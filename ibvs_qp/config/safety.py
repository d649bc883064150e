"""Settings of the supervisor and its monitors (`ibvs_qp.supervision`, docs/safety.md)."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class SafetySettings:
    """Limits of the monitors and motions of the supervisor."""

    supervise: bool = setting(True, "the supervisor acts; without it only the checks of inputs remain")
    self_check: bool = setting(True, "find sensor data in other axes than FRD and NED before the first touch")

    force_offset_n: float = setting(
        0.85,
        "largest error of the force that the force sensor reads at rest",
        unit="N",
        why="0.35 N of zero offset, and cross-talk of 2 % at three standard deviations; a smaller error finds smaller "
        "turns of the sensor by the tool's weight",
        low=0.01,
        high=20.0,
    )
    moment_offset_n_m: float = setting(
        0.07,
        "the same of the moment: half again the largest of 60 flights in the harsh world",
        unit="N m",
        low=0.001,
        high=2.0,
    )

    image_age_s: float = setting(0.2, "oldest picture: latency, and two dropped ones", unit="s", low=0.05, high=5.0)
    first_picture_s: float = setting(
        3.0, "first picture and wall plane after the start, where they are expected", unit="s", low=0.1, high=600.0
    )
    plane_age_s: float = setting(0.3, "oldest wall plane", unit="s", low=0.05, high=5.0)
    lines_age_s: float = setting(0.5, "oldest picture with a line", unit="s", low=0.1, high=10.0)
    wrench_age_s: float = setting(0.03, "oldest force sample: three periods at 100 Hz", unit="s", low=0.005, high=1.0)
    imu_age_s: float = setting(
        0.02, "oldest attitude, gyro or accelerometer: five ticks", unit="s", low=0.002, high=0.5
    )
    frozen_samples: int = setting(
        10, "force samples in a row that repeat, of a sensor that has noise: 0.1 s", low=3, high=1000
    )
    frozen_pictures: int = setting(4, "the same of pictures: 0.13 s", low=2, high=1000)
    frozen_imu_samples: int = setting(6, "the same of inertial samples: 24 ms", low=3, high=1000)
    refusal_s: float = setting(
        0.25, "longest refusal of camera velocities by the filter", unit="s", low=0.05, high=10.0
    )

    unfelt_push_n: float = setting(
        8.0, "push by inertial data that the force sensor must measure too", unit="N", low=1.0, high=50.0
    )
    unfelt_ratio: float = setting(0.3, "fraction of it that the force sensor must measure", low=0.0, high=1.0)
    push_ratio: float = setting(2.2, "largest measured push over the reference", low=1.1, high=10.0)
    push_floor_n: float = setting(6.0, "a touch may reach this push at any reference", unit="N", low=0.5, high=50.0)
    push_time_s: float = setting(0.1, "either push for this long is a fault", unit="s", low=0.0, high=5.0)
    missing_thrust_n: float = setting(2.5, "thrust that a rotor may miss", unit="N", low=0.5, high=50.0)
    missing_sigmas: float = setting(
        6.0, "and this many standard deviations in flight: 3 N in the datasheet world", low=2.0, high=50.0
    )
    missing_time_s: float = setting(0.04, "missing for this long is a fault", unit="s", low=0.0, high=1.0)
    missing_lift_n: float = setting(
        5.0, "lift that all rotors together may miss: a twelfth of the weight", unit="N", low=0.5, high=100.0
    )
    missing_lift_time_s: float = setting(0.1, "missing for this long is a fault", unit="s", low=0.0, high=1.0)

    tilt_deg: float = setting(12.0, "largest tilt", unit="deg", low=2.0, high=60.0)
    flip_deg: float = setting(60.0, "tilt that ends the flight", unit="deg", low=20.0, high=180.0)
    rate_rad_s: float = setting(3.0, "largest angular rate", unit="rad/s", low=0.2, high=30.0)
    speed_m_s: float = setting(0.7, "largest speed by the estimate", unit="m/s", low=0.1, high=10.0)
    height_m: float = setting(
        2.5,
        "largest change of height by the odometer",
        unit="m",
        why="a wall of 1.7 m and a start half a metre away",
        low=0.1,
        high=100.0,
    )
    mission_s: float = setting(
        1800.0,
        "longest flight",
        unit="s",
        why="20 rows of 2.9 m, and twice as long where gusts have most strokes painted again",
        low=1.0,
        high=1e5,
    )
    envelope_time_s: float = setting(0.1, "beyond any of these for this long is a fault", unit="s", low=0.0, high=5.0)
    wall_gone_m: float = setting(
        0.04, "distance of the wall from a tip that was in contact", unit="m", low=0.01, high=1.0
    )
    contact_lost_s: float = setting(5.0, "longest search for a lost contact", unit="s", low=0.2, high=60.0)

    retreat_m: float = setting(0.35, "tip to wall after a retreat", unit="m", low=0.1, high=3.0)
    blind_retreat_m: float = setting(
        3.0,
        "the same without camera: farther than the flight still lasts, because the speed by inertial data drifts",
        unit="m",
        low=0.1,
        high=10.0,
    )
    tilting_retreat_m: float = setting(
        1.0, "the same with a faulty rotor: a vehicle that moves by tilting swings", unit="m", low=0.1, high=10.0
    )
    descend_speed_m_s: float = setting(
        0.25, "speed of a descent", unit="m/s", why="slow: nothing measures the height", low=0.05, high=1.0
    )
    fast_descend_speed_m_s: float = setting(
        0.5,
        "speed of a descent with a rotor lost",
        unit="m/s",
        why="the vehicle turns ever faster: on the ground in 3 s; legs take 0.6 m/s",
        low=0.05,
        high=1.0,
    )
    landed_ratio: float = setting(0.3, "weight carried by the ground that counts as landed", low=0.05, high=1.0)
    landed_time_s: float = setting(0.3, "carried for this long", unit="s", low=0.05, high=5.0)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
