"""Settings of the supervisor and its monitors (`ibvs_qp.supervision`, docs/safety.md)."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import Checked, setting
from ibvs_qp.measurement import SensorFrame, channels

_ATTITUDE, _WRENCH = (channels(SensorFrame)[name] for name in ("attitude", "wrench"))


@dataclass(frozen=True, kw_only=True)
class SafetySettings(Checked):
    """Limits of the monitors and motions of the supervisor."""

    supervise: bool = setting(True, "the supervisor acts; without it only the checks of inputs remain")
    self_check: bool = setting(True, "find sensor data in other axes than FRD and NED before the first touch")

    force_offset_n: float = setting(
        0.85,
        "largest error of the force sensor at rest",
        unit="N",
        why="0.35 N of offset and 2 % of cross-talk at 3 sigma; a smaller one finds smaller turns of the sensor",
        low=0.01,
        high=20.0,
    )
    moment_offset_n_m: float = setting(0.07, "moment: 1.5 times the largest of 60 harsh flights", "N m", 0.001, 2.0)

    image_age_s: float = setting(0.2, "oldest image: latency and two dropped ones", "s", 0.05, 5.0)
    first_picture_s: float = setting(3.0, "latest first image and wall plane", "s", 0.1, 600.0)
    plane_age_s: float = setting(0.3, "oldest wall plane", "s", 0.05, 5.0)
    lines_age_s: float = setting(0.5, "oldest image with a line", "s", 0.1, 10.0)
    wrench_age_s: float = setting(_WRENCH.oldest_s, "oldest force sample: three periods at 100 Hz", "s", 0.005, 1.0)
    imu_age_s: float = setting(
        _ATTITUDE.oldest_s, "oldest attitude, gyro or accelerometer: five ticks", "s", 0.002, 0.5
    )
    frozen_samples: int = setting(10, "equal force samples in a row, of a sensor with noise: 0.1 s", low=3, high=1000)
    frozen_pictures: int = setting(4, "the same of images: 0.13 s", low=2, high=1000)
    frozen_imu_samples: int = setting(6, "the same of inertial samples: 24 ms", low=3, high=1000)
    refusal_s: float = setting(0.25, "longest refusal of camera velocities by the filter", "s", 0.05, 10.0)

    unfelt_push_n: float = setting(8.0, "push by inertial data that the force sensor must confirm", "N", 1.0, 50.0)
    unfelt_ratio: float = setting(0.3, "fraction of it that the force sensor must measure", low=0.0, high=1.0)
    push_ratio: float = setting(2.2, "largest measured push over the reference", low=1.1, high=10.0)
    push_floor_n: float = setting(6.0, "a touch may reach this push at any reference", "N", 0.5, 50.0)
    push_time_s: float = setting(0.1, "either push for this long is a fault", "s", 0.0, 5.0)
    missing_thrust_n: float = setting(2.5, "thrust that a rotor may miss", "N", 0.5, 50.0)
    missing_sigmas: float = setting(6.0, "and standard deviations: 3 N in the datasheet world", low=2.0, high=50.0)
    missing_time_s: float = setting(0.04, "missing for this long is a fault", "s", 0.0, 1.0)
    missing_lift_n: float = setting(5.0, "missing lift of all rotors: a twelfth of the weight", "N", 0.5, 100.0)
    missing_lift_time_s: float = setting(0.1, "missing for this long is a fault", "s", 0.0, 1.0)

    tilt_deg: float = setting(12.0, "largest tilt", "deg", 2.0, 60.0)
    flip_deg: float = setting(60.0, "tilt that ends the flight", "deg", 20.0, 180.0)
    rate_rad_s: float = setting(3.0, "largest angular rate", "rad/s", 0.2, 30.0)
    speed_m_s: float = setting(0.7, "largest speed by the estimate", "m/s", 0.1, 10.0)
    height_m: float = setting(2.5, "largest change of height", "m", 0.1, 100.0, why="wall of 1.7 m, start at 0.5 m")
    mission_s: float = setting(
        1800.0, "longest flight", "s", 1.0, 1e5, why="20 rows of 2.9 m, most painted twice in gusts"
    )
    envelope_time_s: float = setting(0.1, "beyond any of these for this long is a fault", "s", 0.0, 5.0)
    wall_gone_m: float = setting(0.04, "distance of the wall from a tip that was in contact", "m", 0.01, 1.0)
    contact_lost_s: float = setting(5.0, "longest search for a lost contact", "s", 0.2, 60.0)

    retreat_m: float = setting(0.35, "tip to wall after a retreat", "m", 0.1, 3.0)
    blind_retreat_m: float = setting(
        3.0, "the same without camera: not reached, because inertial speed drifts", "m", 0.1, 10.0
    )
    tilting_retreat_m: float = setting(1.0, "the same with a faulty rotor: tilting swings", "m", 0.1, 10.0)
    descend_speed_m_s: float = setting(0.25, "speed of a descent", "m/s", 0.05, 1.0, why="height is not measured")
    fast_descend_speed_m_s: float = setting(
        0.5, "the same with a rotor lost", "m/s", 0.05, 1.0, why="spins up; legs take 0.6 m/s"
    )
    landed_ratio: float = setting(0.3, "weight carried by the ground that counts as landed", low=0.05, high=1.0)
    landed_time_s: float = setting(0.3, "carried for this long", "s", 0.05, 5.0)
