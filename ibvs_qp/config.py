"""Configuration of a controller: frozen, validated, with a TOML round trip.

Every number states its unit, allowed range and reason. The switches at the end of `ControllerConfig` are the
ablations of the experiments. Gains and switches are shared by both laws; weights, limits and solver belong to the
quadratic program.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ibvs_qp.errors import out_of_range
from ibvs_qp.loop_margin import BrushSettings, require_margin
from ibvs_qp.program_settings import LimitSettings, Weights
from ibvs_qp.settings import choice, dump_toml, load_toml, require_order, setting, validate
from ibvs_qp.vehicle import VehicleParams

#: No estimator or filter takes a tick to last longer than this [s]: after a pause they go on from where they were.
LONGEST_TICK = 0.02


@dataclass(frozen=True, kw_only=True)
class Gains:
    """Feedback gains, the same object for both laws."""

    line_kp: float = setting(25.23, "line error to image acceleration", unit="1/s^2", low=0.0, high=200.0)
    line_kd: float = setting(5.585, "line error rate", unit="1/s", low=0.0, high=100.0)
    line_ki: float = setting(1.12, "integral of the line error", unit="1/s^3", low=0.0, high=100.0)
    theta_kp: float = setting(46.51, "line angle error", unit="1/s^2", low=0.0, high=400.0)
    theta_kd: float = setting(12.03, "line angle rate", unit="1/s", low=0.0, high=100.0)
    line_turn_share: float = setting(
        0.882,
        "share of the body's turn that line rows count on in contact, where the tip shall travel",
        low=0.0,
        high=1.0,
    )
    velocity_kp: float = setting(1.787, "velocity error along free directions", unit="1/s", low=0.0, high=50.0)
    velocity_ki: float = setting(3.242, "integral of that error", unit="1/s^2", low=0.0, high=50.0)
    attitude_kp: float = setting(30.33, "roll and pitch", unit="1/s^2", low=0.0, high=400.0)
    attitude_kd: float = setting(8.505, "roll and pitch rate", unit="1/s", low=0.0, high=100.0)
    yaw_kp: float = setting(50.63, "yaw to the wall normal", unit="1/s^2", low=0.0, high=400.0)
    yaw_kd: float = setting(8.054, "yaw rate", unit="1/s", low=0.0, high=100.0)
    standoff_kp: float = setting(2.0, "distance error to approach speed", unit="1/s", low=0.0, high=20.0)
    standoff_kd: float = setting(5.0, "approach speed error to acceleration", unit="1/s", low=0.0, high=50.0)
    force_ksp: float = setting(12.84, "impedance stiffness K_sp", unit="N/m", low=0.0, high=5000.0)
    force_ksd: float = setting(44.53, "impedance damping K_sd", unit="N s/m", low=0.0, high=1000.0)
    force_kfp: float = setting(0.3467, "force error K_fp at 1.5 kN/m and softer", low=0.0, high=10.0)
    force_kfi: float = setting(0.4044, "integral of the force error K_fi", unit="1/s", low=0.0, high=50.0)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)


@dataclass(frozen=True, kw_only=True)
class ContactSettings:
    """Approach, touch and release (section 4.2 of the design)."""

    approach_speed_m_s: float = setting(0.10, "approach speed far from the wall", unit="m/s", low=0.005, high=0.5)
    close_speed_m_s: float = setting(0.05, "approach speed within close_distance", unit="m/s", low=0.002, high=0.3)
    close_distance_m: float = setting(0.10, "where the approach slows down", unit="m", low=0.01, high=1.0)
    touch_speed_m_s: float = setting(
        0.012, "speed of the last centimetre while the stiffness is unknown", unit="m/s", low=0.001, high=0.2
    )
    touch_distance_m: float = setting(0.01, "where the last centimetre begins", unit="m", low=0.005, high=0.2)
    landing_kd: float = setting(
        15.0,
        "approach speed error to acceleration in the last centimetre: 90 N s/m absorb a touch that the brush does not; "
        "above, the approach-speed barrier would bind",
        unit="1/s",
        low=0.0,
        high=50.0,
    )
    retreat_speed_m_s: float = setting(0.15, "speed away from the wall", unit="m/s", low=0.01, high=0.5)
    depth_min_m: float = setting(0.53, "camera to wall, lambda = 1 below", unit="m", low=0.1, high=3.0)
    depth_max_m: float = setting(0.63, "camera to wall, lambda = 0 above", unit="m", low=0.1, high=3.0)
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
        1.0, "share of the measured contact moment fed forward; a stuck tip returns 0.9 of it", low=0.0, high=1.0
    )
    moment_noise_n: float = setting(
        1.0,
        "filtered force noise at which that share halves: the loop through a stuck tip multiplies noise",
        unit="N",
        low=0.01,
        high=100.0,
    )
    friction_gain: float = setting(0.9, "share of the friction along travel fed forward", low=0.0, high=1.0)
    friction_slew_n_s: float = setting(6.0, "fastest change of that force", unit="N/s", low=0.1, high=100.0)
    stuck_speed_m_s: float = setting(
        0.005, "slower than this in contact counts as stuck", unit="m/s", low=0.0, high=0.1
    )

    def __post_init__(self) -> None:
        """Validate; pairs too that only make sense in one order."""
        validate(self)
        require_order(self, "depth_min_m", "depth_max_m", "lambda falls from 1 to 0 between them")
        require_order(self, "touch_distance_m", "close_distance_m", "the last centimetre is the end of the slow part")
        require_order(self, "loss_force_n", "touch_force_n", "a touch would be lost as it is found")


@dataclass(frozen=True, kw_only=True)
class SolverSettings:
    """OSQP and the acceptance test."""

    max_iterations: int = setting(200, "deterministic deadline", low=1, high=100000)
    tolerance: float = setting(1e-5, "eps_abs", low=1e-10, high=1e-1)
    relative_tolerance: float = setting(
        1e-6, "eps_rel; where limits bind the active rows are solved exactly afterwards", low=1e-10, high=1e-1
    )
    check_interval: int = setting(5, "iterations between termination checks", low=1, high=1000)
    adaptive_rho_interval: int = setting(25, "iterations between step-size updates", low=1, high=10000)
    scaling: int = setting(
        2, "Ruiz equilibration passes; ten cost 4 us more per tick and no iteration less", low=0, high=100
    )
    shortcut: bool = setting(
        True, "where no row binds, or the rows of the last tick do, the exact solution flies and OSQP is not asked"
    )
    polish: bool = setting(True, "solve the rows that OSQP found active exactly, and keep the answer if it is optimal")
    direct: bool = setting(True, "talk to OSQP's extension object (half the overhead) instead of its wrapper")
    accept_residual: float = setting(5e-2, "largest violation of a capped solution", unit="N", low=1e-9, high=10.0)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)


@dataclass(frozen=True, kw_only=True)
class ControllerConfig:
    """Everything a controller needs; the default flies the Tarot T960."""

    vehicle: VehicleParams = field(default_factory=VehicleParams)
    gains: Gains = field(default_factory=Gains)
    contact: ContactSettings = field(default_factory=ContactSettings)
    weights: Weights = field(default_factory=Weights)
    limits: LimitSettings = field(default_factory=LimitSettings)
    solver: SolverSettings = field(default_factory=SolverSettings)
    brush: BrushSettings = field(default_factory=BrushSettings)
    line_profile: str = choice(
        "tip",
        "error of the line rows: at the point where the tip meets the wall, or the paper's, rho at the image centre",
        ("tip", "paper"),
    )
    line_slots: int = setting(3, "lines the fixed program has room for; each costs 500 instructions", low=1, high=16)
    tick_s: float = setting(
        0.004, "control period; a longer tick than 0.02 s is taken for a pause", unit="s", low=0.0005, high=LONGEST_TICK
    )
    impedance: bool = setting(True, "impedance terms of the force law (False: direct force control)")
    contact_feedforward: bool = setting(True, "feed the measured contact moment and expected friction forward")
    touch_ramp: bool = setting(True, "ramp lambda and the force reference after touch")
    reach_check: bool = setting(True, "reduce a push that the vehicle cannot hold")
    barriers: bool = setting(True, "all barriers; each has its own switch in limits")
    thrust_rows: bool = setting(
        True, "the program knows the rotors' limits (False: it does not, and its thrusts are clipped afterwards)"
    )
    machine_code: bool = setting(
        False, "translate the tick with the C compiler, if there is one: the same bits, 1 s once, 25 us less per tick"
    )

    def __post_init__(self) -> None:
        """Validate; the depths at which the push begins against the arm's length too."""
        validate(self)
        arm = round(self.vehicle.tip_position_m[0] - self.vehicle.camera_position_m[0], 9)
        if self.contact.depth_min_m < arm:
            allowed = f"allowed is at least {arm:g} m, where the camera is when the tip touches"
            raise out_of_range("contact.depth_min_m", self.contact.depth_min_m, "m", allowed)

    @classmethod
    def from_toml(cls, file: str | Path) -> ControllerConfig:
        """Read a preset; ConfigError names field, value, unit and allowed range, also where the contact would ring."""
        config = load_toml(cls, file)
        require_margin(config, config.brush, f"{file}: ")
        return config

    def to_toml(self) -> str:
        """Write the configuration as TOML text."""
        return dump_toml(self)
