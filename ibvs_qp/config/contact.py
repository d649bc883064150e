"""Settings of approach, touch, press and release."""

from __future__ import annotations

from dataclasses import dataclass, field

from ibvs_qp.config.contact_estimation import ContactEstimationSettings
from ibvs_qp.config.settings import require_order, setting, validate


@dataclass(frozen=True, kw_only=True)
class ContactSettings:
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
        validate(self)
        require_order(self, "depth_min_m", "depth_max_m", "lambda falls from 1 to 0 between them")
        require_order(self, "touch_distance_m", "close_distance_m", "the last centimetre is the end of the slow part")
        require_order(self, "loss_force_n", "touch_force_n", "a touch would be lost as it is found")
