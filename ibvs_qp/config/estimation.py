"""Settings of the pilot's estimators: motion in the wall plane, tracked lines, tare of the wrench."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class EstimationConfig:
    """Noise models and life times; defaults from the sensors of the design, section 5."""

    acceleration_noise: float = setting(
        8e-3, "acceleration in the wall plane, with the attitude noise", unit="m/s^2/sqrt(Hz)", low=1e-5, high=1.0
    )
    bias_noise: float = setting(
        3e-3,
        "drift of the accelerometer bias, with gravity through attitude",
        unit="m/s^3/sqrt(Hz)",
        low=1e-6,
        high=1.0,
    )
    vibration_time_s: float = setting(
        1.0,
        "averaging time of the accelerometer's broadband noise; it replaces a smaller acceleration_noise",
        unit="s",
        low=0.05,
        high=60.0,
    )
    calm_change: float = setting(
        0.01,
        "changes of the acceleration in the wall plane, beyond motors and contact, at which motors' model and "
        "accelerometer have equal weights; 0 uses the accelerometer alone",
        unit="m/s^2",
        why="gusts of 2 N change it by 0.25 m/s^2, errors of the model in calm air by 0.01",
        low=0.0,
        high=10.0,
    )
    line_noise: float = setting(
        1e-3, "random walk of line offsets: edges are not perfectly straight", unit="m/sqrt(s)", low=1e-6, high=0.1
    )
    paint_noise: float = setting(
        7e-3,
        "random walk of the offsets of painted edges",
        unit="m/sqrt(s)",
        why="the piece in view moves along a path that swings by 3 deg: 5 mm/s that change within a second",
        low=1e-6,
        high=0.1,
    )
    line_std_m: float = setting(
        3e-4, "least deviation of a line offset; the frames may show more", unit="m", low=1e-6, high=0.1
    )
    velocity_std_m_s: float = setting(2e-3, "least deviation of one flow velocity", unit="m/s", low=1e-6, high=1.0)
    angle_std_rad: float = setting(
        3e-3, "least deviation of a line angle: attitude noise, growth of a short edge", unit="rad", low=1e-6, high=0.1
    )
    angle_noise: float = setting(
        2.7e-3, "random walk of line angles: an angle follows within 0.2 s", unit="rad/sqrt(s)", low=1e-7, high=0.1
    )
    frames_to_trust: int = setting(4, "frames until a new line has full weight", low=1, high=100)
    fade_start_s: float = setting(0.10, "a line without new frames fades from here", unit="s", low=0.01, high=5.0)
    fade_end_s: float = setting(0.45, "and is dropped after this time", unit="s", low=0.05, high=10.0)
    gate_sigmas: float = setting(6.0, "larger innovations of offset or velocity are refused", low=1.0, high=100.0)
    refusal_s: float = setting(
        0.5, "a velocity refused for longer starts the filter anew from what is seen", unit="s", low=0.05, high=10.0
    )
    refused_frames: int = setting(3, "agreeing refused offsets in a row that start a new line", low=1, high=100)
    velocity_life_s: float = setting(0.6, "an older velocity is not used", unit="s", low=0.05, high=10.0)
    tare_time_s: float = setting(
        0.5, "free flight averaged before the wrench is trusted", unit="s", low=0.05, high=10.0
    )
    tare_follow_s: float = setting(20.0, "time constant of the bias after that", unit="s", low=0.5, high=1000.0)
    tare_distance_m: float = setting(0.04, "the tip counts as free beyond this distance", unit="m", low=0.005, high=1.0)
    tare_acceleration_gain: float = setting(
        0.3, "accelerometer filter of the tool's load, in 4 ms: about a force sample", low=0.001, high=1.0
    )
    force_std_n: float = setting(
        0.02, "least deviation of a force sample; the samples may show more", unit="N", low=1e-4, high=10.0
    )
    contact_spread_m: float = setting(
        0.01, "largest distance of the contact from the tip's centre", unit="m", low=0.0, high=0.5
    )

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
