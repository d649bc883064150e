"""Settings of the contact estimator: noise of distance, rate and push, touch on a rebound, stiffness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ibvs_qp.config.settings import require_order, setting, validate

#: Process noise of the filter of push and disturbance: of the rotors, 1 % with 50 ms, is 0.1 N along the normal; of the
#: push, by an uncertain stiffness [N/sqrt(s)].
ROTOR_NOISE, STIFFNESS_NOISE = 0.031, 0.1
#: Noise of a force sensor that measures none [N^2/Hz]: 0.1 N per sample at 100 Hz.
LEAST_PUSH_DENSITY = 1e-4


@dataclass(frozen=True, kw_only=True)
class ContactEstimationSettings:
    """Distance filter, push noise and stiffness (section 4.2 of the design)."""

    acceleration_noise: float = setting(
        6e-3, "acceleration along the normal, with the attitude noise", unit="m/s^2/sqrt(Hz)", low=1e-5, high=1.0
    )
    bias_time_s: float = setting(
        1.6,
        "the accelerometer's bias is learnt within this time, with gravity through attitude: a wrong one keeps the tip "
        "off the wall",
        unit="s",
        low=0.2,
        high=100.0,
    )
    normal_gate_deg: float = setting(
        5.0,
        "planes whose normal is farther from the one predicted by the gyro are refused",
        unit="deg",
        low=1.0,
        high=90.0,
    )
    acceleration_filter_s: float = setting(
        6e-3,
        "filter of the acceleration that predicts the rate: a tenth of the motors' lag",
        unit="s",
        low=1e-4,
        high=0.5,
    )
    acceleration_quiet_m_s2: float = setting(
        0.3, "noise of the filtered acceleration at which it counts half", unit="m/s^2", low=1e-3, high=100.0
    )
    vibration_time_s: float = setting(
        1.0,
        "averaging time of the accelerometer's noise; it replaces a smaller acceleration_noise",
        unit="s",
        low=0.05,
        high=60.0,
    )
    distance_std_m: float = setting(
        1.2e-3, "distance of one fitted plane: common mode of the depth camera", unit="m", low=1e-5, high=0.1
    )
    gate_sigmas: float = setting(6.0, "a distance with a larger innovation has outlier_std_m", low=1.0, high=100.0)
    outlier_std_m: float = setting(0.02, "distance beyond the gate but within jump_m", unit="m", low=1e-4, high=1.0)
    jump_m: float = setting(
        0.05, "a plane this far from the expected distance is refused at first", unit="m", low=0.005, high=1.0
    )
    refused_frames: int = setting(
        5, "planes beyond the gate in a row, on one side, after which distance and speed start anew", low=1, high=100
    )
    normal_gain: float = setting(0.15, "correction of the normal per frame: mean of six frames", low=0.001, high=1.0)
    stationary_after_s: float = setting(
        0.3, "time from touch until the tip counts as stationary", unit="s", low=0.0, high=5.0
    )
    stationary_distance_std_m: float = setting(
        5e-3, "distance while the tip is stationary: damping would turn noise into push", unit="m", low=1e-5, high=0.1
    )
    stationary_speed_std_m_s: float = setting(
        5e-3, "speed of a stationary tip: the swing of the contact", unit="m/s", low=1e-5, high=1.0
    )
    noise_time_s: float = setting(1.0, "averaging time of the push noise in free flight", unit="s", low=0.05, high=60.0)
    bounce_time_s: float = setting(0.5, "a touch this soon after a loss resumes the ramp", unit="s", low=0.0, high=5.0)
    bounce_ramp: float = setting(0.4, "latest point of a resumed ramp: 16 % of the push", low=0.0, high=1.0)
    assumed_stiffness_n_m: float = setting(
        10_000.0, "stiffness until it is measured: a stiff wall forgives least", unit="N/m", low=100.0, high=1e5
    )
    stiffness_min_n_m: float = setting(300.0, "softest estimate, clipped there", unit="N/m", low=10.0, high=1e5)
    stiffness_max_n_m: float = setting(30_000.0, "stiffest estimate, clipped there", unit="N/m", low=10.0, high=1e6)

    calm_noise: float = setting(
        0.187,
        "process noise of the force along the normal in calm air",
        why="least push error of the linear loop in calm air and, below, in gusts of 2 N rms",
        unit="N/sqrt(s)",
        low=1e-3,
        high=100.0,
    )
    gust_noise: float = setting(5.34, "the same in full gusts", unit="N/sqrt(s)", low=1e-3, high=100.0)
    slow_noise: float = setting(
        0.128, "the same of the force that the accelerometer does not measure", unit="N/sqrt(s)", low=1e-3, high=100.0
    )

    def push_noise(self, mass_kg: float, gusts: Any) -> tuple[Any, ...]:
        """Process noise densities of elastic push, rate and both forces of the push filter, at a weight of gusts."""
        force = self.calm_noise**2 + self.gust_noise**2 * gusts
        return STIFFNESS_NOISE**2, (ROTOR_NOISE / mass_kg) ** 2, force, self.slow_noise**2

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
        require_order(self, "distance_std_m", "outlier_std_m", "an outlier would count more than an ordinary distance")
        require_order(self, "stiffness_min_n_m", "stiffness_max_n_m", "no estimate would be accepted")
