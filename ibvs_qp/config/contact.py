"""Settings of the contact: wall and brush, its estimator, and approach, touch, press and release."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.settings import Checked, require_order, setting
from ibvs_qp.config.vehicle import VehicleParams

#: Camera to wall beyond that in contact [m]: the push is full up to the first and none from the second. The depth of a
#: image is good to millimetres, and the stand-off before a touch is 6 cm.
_FULL_PUSH_M, _NO_PUSH_M = 0.03, 0.13
#: Process noise of the filter of push and disturbance: of the rotors, 1 % with 50 ms, is 0.1 N along the normal; of the
#: push, by an uncertain stiffness [N/sqrt(s)].
ROTOR_NOISE, STIFFNESS_NOISE = 0.031, 0.1
#: Noise of a force sensor that measures none [N^2/Hz]: 0.1 N per sample at 100 Hz.
LEAST_PUSH_DENSITY = 1e-4


@dataclass(frozen=True, kw_only=True)
class BrushSettings(Checked):
    """Contact of a preset: wall and brush in series, and the age of the measured force."""

    stiffness_min_n_m: float = setting(1000.0, "softest wall and brush", "N/m", 50.0, 1e5)
    stiffness_max_n_m: float = setting(3500.0, "stiffest; 30 N s/m damp 4 kN/m by a tenth", "N/m", 50.0, 1e5)
    damping_n_s_m: float = setting(30.0, "damping of wall and brush", "N s/m", 0.0, 1e4)
    force_delay_s: float = setting(0.009, "mean age of the force: 4 ms and half a period of 100 Hz", "s", 0.0, 0.5)

    def __post_init__(self) -> None:
        """Validate; the stiffnesses in their order."""
        super().__post_init__()
        if self.stiffness_min_n_m > self.stiffness_max_n_m:
            allowed = f"at most stiffness_max_n_m = {self.stiffness_max_n_m:g} N/m"
            raise out_of_range("stiffness_min_n_m", self.stiffness_min_n_m, "N/m", allowed)


@dataclass(frozen=True, kw_only=True)
class ContactEstimationSettings(Checked):
    """Distance filter, push noise and stiffness (section 4.2 of the design)."""

    acceleration_noise: float = setting(6e-3, "acceleration along the normal and attitude", "m/s^2/sqrt(Hz)", 1e-5, 1.0)
    bias_time_s: float = setting(
        1.6,
        "time to learn the accelerometer bias, with gravity through attitude; a wrong one stops the approach",
        unit="s",
        low=0.2,
        high=100.0,
    )
    normal_gate_deg: float = setting(5.0, "largest turn of a plane's normal from the prediction", "deg", 1.0, 90.0)
    acceleration_filter_s: float = setting(
        6e-3, "filter of the acceleration: a tenth of the motors' lag", "s", 1e-4, 0.5
    )
    acceleration_quiet_m_s2: float = setting(0.3, "its noise at which it counts half", "m/s^2", 1e-3, 100.0)
    vibration_time_s: float = setting(
        1.0, "average of the accelerometer's noise; replaces a smaller acceleration_noise", "s", 0.05, 60.0
    )
    distance_std_m: float = setting(1.2e-3, "distance of one plane: common mode of the depth camera", "m", 1e-5, 0.1)
    gate_sigmas: float = setting(6.0, "a distance with a larger innovation has outlier_std_m", low=1.0, high=100.0)
    outlier_std_m: float = setting(0.02, "distance beyond the gate but within jump_m", "m", 1e-4, 1.0)
    jump_m: float = setting(0.05, "a plane this far from the expected distance is refused at first", "m", 0.005, 1.0)
    refused_frames: int = setting(
        5, "planes in a row beyond the gate on one side that reset the filter", low=1, high=100
    )
    normal_gain: float = setting(0.15, "correction of the normal per frame: mean of six frames", low=0.001, high=1.0)
    stationary_after_s: float = setting(0.3, "time from touch until the tip counts as stationary", "s", 0.0, 5.0)
    stationary_distance_std_m: float = setting(
        5e-3, "distance of a stationary tip; damping turns noise into push", "m", 1e-5, 0.1
    )
    stationary_speed_std_m_s: float = setting(5e-3, "speed of a stationary tip: contact swing", "m/s", 1e-5, 1.0)
    noise_time_s: float = setting(1.0, "averaging time of the push noise in free flight", "s", 0.05, 60.0)
    bounce_time_s: float = setting(0.5, "a touch this soon after a loss resumes the ramp", "s", 0.0, 5.0)
    bounce_ramp: float = setting(0.4, "latest point of a resumed ramp: 16 % of the push", low=0.0, high=1.0)
    assumed_stiffness_n_m: float = setting(10_000.0, "initial stiffness: a stiff wall is hardest", "N/m", 100.0, 1e5)
    stiffness_min_n_m: float = setting(300.0, "softest estimate, clipped there", "N/m", 10.0, 1e5)
    stiffness_max_n_m: float = setting(30_000.0, "stiffest estimate, clipped there", "N/m", 10.0, 1e6)

    calm_noise: float = setting(
        0.187,
        "process noise of the normal force in calm air",
        unit="N/sqrt(s)",
        why="least push error of the linear loop, also in 2 N gusts",
        low=1e-3,
        high=100.0,
    )
    gust_noise: float = setting(5.34, "the same in full gusts", "N/sqrt(s)", 1e-3, 100.0)
    slow_noise: float = setting(0.128, "the same of force that no accelerometer measures", "N/sqrt(s)", 1e-3, 100.0)

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

    approach_speed_m_s: float = setting(0.10, "approach speed far from the wall", "m/s", 0.005, 0.5)
    close_speed_m_s: float = setting(0.05, "approach speed within close_distance", "m/s", 0.002, 0.3)
    close_distance_m: float = setting(0.10, "where the approach slows down", "m", 0.01, 1.0)
    touch_speed_m_s: float = setting(0.012, "speed in the last centimetre, stiffness unknown", "m/s", 0.001, 0.2)
    touch_distance_m: float = setting(0.01, "where the last centimetre begins", "m", 0.005, 0.2)
    landing_kd: float = setting(15.0, "standoff_kd in the last centimetre: 90 N s/m absorb a touch", "1/s", 0.0, 50.0)
    retreat_speed_m_s: float = setting(0.15, "speed away from the wall", "m/s", 0.01, 0.5)
    retreat_time_s: float = setting(
        10.0,
        "longest flight to a stand-off; farther ones are faster",
        unit="s",
        why="blind, an attitude off by 0.5 deg (0.09 m/s^2) must not bring the vehicle back before it lands",
        low=2.0,
        high=60.0,
    )
    depth_min_m: float = setting(
        None, "camera to wall, lambda = 1 below; default from tip and camera", "m", 0.01, 5.0, why="contact + 3 cm"
    )
    depth_max_m: float = setting(
        None, "camera to wall, lambda = 0 above; default from tip and camera", "m", 0.01, 5.0, why="contact + 13 cm"
    )
    ramp_s: float = setting(1.0, "lambda and the force reference rise over this time after touch", "s", 0.05, 10.0)
    touch_force_n: float = setting(0.5, "least filtered force that counts as touch", "N", 0.05, 10.0)
    touch_sigmas: float = setting(3.0, "touch threshold over the free-flight noise", low=1.0, high=10.0)
    touch_samples: int = setting(3, "force samples above threshold in a row", low=1, high=50)
    contact_distance_m: float = setting(0.01, "touch only nearer, loss when farther", "m", 0.002, 0.1)
    loss_force_n: float = setting(0.3, "force below which contact is doubted", "N", 0.01, 10.0)
    loss_time_s: float = setting(0.10, "doubt this long is a loss", "s", 0.01, 2.0)
    force_filter_hz: float = setting(8.0, "first-order filter of the measured push", "Hz", 0.5, 100.0)
    moment_gain: float = setting(1.0, "contact moment in the feed-forward; a stuck tip returns 0.9", low=0.0, high=1.0)
    moment_noise_n: float = setting(1.0, "filtered force noise that halves that gain", "N", 0.01, 100.0)
    friction_gain: float = setting(
        0.92,
        "gain of the friction along the travel in the feed-forward",
        why="the velocity integral learns the rest: with 0.9 a slide at friction 0.8 is 4 % slow or 2 % fast",
        low=0.0,
        high=1.0,
    )
    assumed_friction: float = setting(
        0.8,
        "friction coefficient in the reach check until a slide of 1 s has measured it",
        why="largest of a dry brush: a push that friction stops turns the vehicle about its tip",
        low=0.02,
        high=1.2,
    )
    friction_patience_s: float = setting(0.15, "a tip is stuck that does not travel for this long", "s", 0.01, 10.0)
    friction_rise_1_s: float = setting(1.2, "rise of the friction estimate of a stuck tip", "1/s", 0.0, 10.0)
    friction_slew_n_s: float = setting(10.0, "fastest change of that force", "N/s", 0.1, 100.0)
    stuck_speed_m_s: float = setting(0.005, "slower than this in contact counts as stuck", "m/s", 0.0, 0.1)
    full_gain_stiffness_n_m: float = setting(1500.0, "force_kfp falls with 1/k beyond", "N/m", 50.0, 1e5)
    plane_bandwidth_rad_s: float = setting(
        10.0, "observer of gusts along the wall in contact; 1.5 as in calm air", "rad/s", 1.5, 50.0
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
