"""Settings of the contact: wall and brush, its estimator, and approach, touch, press and release."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.settings import Checked, require_order, setting
from ibvs_qp.config.vehicle import VehicleParams

#: Camera to wall beyond that in contact [m]: the push is full up to the first and none from the second. The depth of a
#: picture is good to millimetres, and the stand-off before a touch is 6 cm.
_FULL_PUSH_M, _NO_PUSH_M = 0.03, 0.13
#: Process noise of the filter of push and disturbance: of the rotors, 1 % with 50 ms, is 0.1 N along the normal; of the
#: push, by an uncertain stiffness [N/sqrt(s)].
ROTOR_NOISE, STIFFNESS_NOISE = 0.031, 0.1
#: Noise of a force sensor that measures none [N^2/Hz]: 0.1 N per sample at 100 Hz.
LEAST_PUSH_DENSITY = 1e-4


@dataclass(frozen=True, kw_only=True)
class BrushSettings(Checked):
    """Contact of a preset: wall and brush in series, and the age of the measured force."""

    stiffness_min_n_m: float = setting(1000.0, "softest wall and brush", unit="N/m", low=50.0, high=1e5)
    stiffness_max_n_m: float = setting(
        3500.0, "stiffest wall and brush; 30 N s/m damp 4 kN/m by a tenth", unit="N/m", low=50.0, high=1e5
    )
    damping_n_s_m: float = setting(30.0, "damping of wall and brush", unit="N s/m", low=0.0, high=1e4)
    force_delay_s: float = setting(
        0.009, "mean age of the force in use: latency 4 ms and half a period of 100 Hz", unit="s", low=0.0, high=0.5
    )

    def __post_init__(self) -> None:
        """Validate; the stiffnesses in their order."""
        super().__post_init__()
        if self.stiffness_min_n_m > self.stiffness_max_n_m:
            allowed = f"at most stiffness_max_n_m = {self.stiffness_max_n_m:g} N/m"
            raise out_of_range("stiffness_min_n_m", self.stiffness_min_n_m, "N/m", allowed)


@dataclass(frozen=True, kw_only=True)
class ContactEstimationSettings(Checked):
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
        """Validate; pairs too that only make sense in one order."""
        super().__post_init__()
        require_order(self, "distance_std_m", "outlier_std_m", "an outlier would count more than an ordinary distance")
        require_order(self, "stiffness_min_n_m", "stiffness_max_n_m", "no estimate would be accepted")


@dataclass(frozen=True, kw_only=True)
class ContactSettings(Checked):
    """Approach, touch and release (section 4.2 of the design)."""

    approach_speed_m_s: float = setting(0.10, "approach speed far from the wall", unit="m/s", low=0.005, high=0.5)
    close_speed_m_s: float = setting(0.05, "approach speed within close_distance", unit="m/s", low=0.002, high=0.3)
    close_distance_m: float = setting(0.10, "where the approach slows down", unit="m", low=0.01, high=1.0)
    touch_speed_m_s: float = setting(
        0.012, "speed in the last centimetre until the stiffness is known", unit="m/s", low=0.001, high=0.2
    )
    touch_distance_m: float = setting(0.01, "where the last centimetre begins", unit="m", low=0.005, high=0.2)
    landing_kd: float = setting(
        15.0, "standoff_kd in the last centimetre: 90 N s/m absorb a touch", unit="1/s", low=0.0, high=50.0
    )
    retreat_speed_m_s: float = setting(0.15, "speed away from the wall", unit="m/s", low=0.01, high=0.5)
    retreat_time_s: float = setting(
        10.0,
        "longest flight to a stand-off: farther ones are flown to faster",
        unit="s",
        why="blind, an attitude off by 0.5 deg (0.09 m/s^2) must not bring the vehicle back before it lands",
        low=2.0,
        high=60.0,
    )
    depth_min_m: float = setting(
        None,
        "camera to wall, lambda = 1 below; from tip and camera if not stated",
        unit="m",
        why="3 cm more than in contact",
        low=0.01,
        high=5.0,
    )
    depth_max_m: float = setting(
        None,
        "camera to wall, lambda = 0 above; from tip and camera if not stated",
        unit="m",
        why="13 cm more than in contact",
        low=0.01,
        high=5.0,
    )
    ramp_s: float = setting(
        1.0, "lambda and the force reference rise over this time after touch", unit="s", low=0.05, high=10.0
    )
    touch_force_n: float = setting(0.5, "least filtered force that counts as touch", unit="N", low=0.05, high=10.0)
    touch_sigmas: float = setting(3.0, "touch threshold over the free-flight noise", low=1.0, high=10.0)
    touch_samples: int = setting(3, "force samples above threshold in a row", low=1, high=50)
    contact_distance_m: float = setting(0.01, "touch only nearer, loss when farther", unit="m", low=0.002, high=0.1)
    loss_force_n: float = setting(0.3, "force below which contact is doubted", unit="N", low=0.01, high=10.0)
    loss_time_s: float = setting(0.10, "doubt this long is a loss", unit="s", low=0.01, high=2.0)
    force_filter_hz: float = setting(8.0, "first-order filter of the measured push", unit="Hz", low=0.5, high=100.0)
    moment_gain: float = setting(
        1.0, "gain of the contact moment in the feed-forward; a stuck tip returns 0.9 of it", low=0.0, high=1.0
    )
    moment_noise_n: float = setting(
        1.0, "filtered force noise that halves that gain: a stuck tip amplifies noise", unit="N", low=0.01, high=100.0
    )
    friction_gain: float = setting(
        0.92,
        "gain of the friction along the travel in the feed-forward",
        why="the velocity integral learns the rest: with 0.9 a slide at friction 0.8 is 4 % slow or 2 % fast",
        low=0.0,
        high=1.0,
    )
    assumed_friction: float = setting(
        0.8,
        "friction coefficient of brush and wall that the reach check assumes until a slide of 1 s has measured it",
        why="the most of a dry brush: a push that friction stops turns the vehicle about its tip",
        low=0.02,
        high=1.2,
    )
    friction_patience_s: float = setting(
        0.15, "a tip that has not followed its travel for this long is stuck", unit="s", low=0.01, high=10.0
    )
    friction_rise_1_s: float = setting(
        1.2, "rise of the estimated friction coefficient while the tip is stuck", unit="1/s", low=0.0, high=10.0
    )
    friction_slew_n_s: float = setting(10.0, "fastest change of that force", unit="N/s", low=0.1, high=100.0)
    stuck_speed_m_s: float = setting(
        0.005, "slower than this in contact counts as stuck", unit="m/s", low=0.0, high=0.1
    )
    full_gain_stiffness_n_m: float = setting(
        1500.0, "up to here force_kfp counts in full, beyond it falls with 1/k", unit="N/m", low=50.0, high=1e5
    )
    plane_bandwidth_rad_s: float = setting(
        10.0,
        "observer of gusts in the wall's plane in contact; 1.5, that of calm air, ignores them",
        unit="rad/s",
        low=1.5,
        high=50.0,
    )
    estimation: ContactEstimationSettings = field(default_factory=ContactEstimationSettings)

    def __post_init__(self) -> None:
        """Validate; pairs too that only make sense in one order."""
        super().__post_init__()
        require_order(self, "depth_min_m", "depth_max_m", "lambda falls from 1 to 0 between them")
        require_order(self, "touch_distance_m", "close_distance_m", "the last centimetre is the end of the slow part")
        require_order(self, "loss_force_n", "touch_force_n", "a touch would be lost as it is found")


def contact_values(vehicle: VehicleParams) -> dict[str, float]:
    """Settings of `ContactSettings` that follow from tip and camera."""
    arm = max(vehicle.contact_depth_m, 0.0)
    return {"depth_min_m": round(arm + _FULL_PUSH_M, 9), "depth_max_m": round(arm + _NO_PUSH_M, 9)}
