"""Settings of the estimators: attitude and angular velocity, motion in the wall plane, tracked lines, tare."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import Checked, setting


@dataclass(frozen=True, kw_only=True)
class AngularRateSettings(Checked):
    """Estimates of attitude and angular velocity, and the lead against the motors' lag (docs/how_it_works/model.md)."""

    gyro_bandwidth_hz: float = setting(12.5, "gyro below, motors' model above; 1000: gyro alone", "Hz", 0.5, 1000.0)
    attitude_bandwidth_hz: float = setting(
        8.0, "roll and pitch by attitude below, by rate above; 1000: attitude alone", "Hz", 0.5, 1000.0
    )
    lead_s: float = setting(0.04, "lead of the rate in damping: two thirds of the motors' lag", "s", 0.0, 0.1)


@dataclass(frozen=True, kw_only=True)
class EstimationConfig(Checked):
    """Noise models and life times; defaults from the sensors of the design, section 5."""

    acceleration_noise: float = setting(8e-3, "acceleration along the wall and attitude", "m/s^2/sqrt(Hz)", 1e-5, 1.0)
    bias_noise: float = setting(3e-3, "drift of its bias, with gravity through attitude", "m/s^3/sqrt(Hz)", 1e-6, 1.0)
    vibration_time_s: float = setting(
        1.0, "average of the accelerometer's noise; replaces a smaller acceleration_noise", "s", 0.05, 60.0
    )
    calm_change: float = setting(
        0.01,
        "unmodelled change of acceleration along the wall at which motors' model and accelerometer weigh the same; 0: "
        "accelerometer alone",
        unit="m/s^2",
        why="gusts of 2 N change it by 0.25 m/s^2, errors of the model in calm air by 0.01",
        low=0.0,
        high=10.0,
    )
    line_noise: float = setting(1e-3, "random walk of line offsets: edges are not straight", "m/sqrt(s)", 1e-6, 0.1)
    paint_noise: float = setting(
        7e-3,
        "random walk of the offsets of painted edges",
        unit="m/sqrt(s)",
        why="edges swing by 3 deg: 5 mm/s that change within a second",
        low=1e-6,
        high=0.1,
    )
    line_std_m: float = setting(3e-4, "least deviation of a line offset; the frames may show more", "m", 1e-6, 0.1)
    velocity_std_m_s: float = setting(2e-3, "least deviation of one flow velocity", "m/s", 1e-6, 1.0)
    angle_std_rad: float = setting(3e-3, "least deviation of a line angle: attitude, short edges", "rad", 1e-6, 0.1)
    angle_noise: float = setting(2.7e-3, "random walk of line angles: followed in 0.2 s", "rad/sqrt(s)", 1e-7, 0.1)
    frames_to_trust: int = setting(4, "frames until a new line has full weight", low=1, high=100)
    fade_start_s: float = setting(0.10, "a line without new frames fades from here", "s", 0.01, 5.0)
    fade_end_s: float = setting(0.45, "and is dropped after this time", "s", 0.05, 10.0)
    gate_sigmas: float = setting(6.0, "larger innovations of offset or velocity are refused", low=1.0, high=100.0)
    refusal_s: float = setting(0.5, "longer refusal of velocities resets the filter to them", "s", 0.05, 10.0)
    refused_frames: int = setting(3, "agreeing refused offsets in a row that start a new line", low=1, high=100)
    velocity_life_s: float = setting(0.6, "an older velocity is not used", "s", 0.05, 10.0)
    tare_time_s: float = setting(0.5, "free flight averaged before the wrench is trusted", "s", 0.05, 10.0)
    tare_follow_s: float = setting(20.0, "time constant of the bias after that", "s", 0.5, 1000.0)
    tare_distance_m: float = setting(0.04, "the tip counts as free beyond this distance", "m", 0.005, 1.0)
    tare_acceleration_gain: float = setting(0.3, "accelerometer filter of the tool load, in 4 ms", low=0.001, high=1.0)
    force_std_n: float = setting(0.02, "least deviation of a force sample; the samples may show more", "N", 1e-4, 10.0)
    contact_spread_m: float = setting(0.01, "largest distance of the contact from the tip's centre", "m", 0.0, 0.5)
