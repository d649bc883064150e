"""Configuration of a controller: frozen, validated, with a TOML round trip.

Every number states its unit, allowed range and reason. The switches at the end of `ControllerConfig` are the
ablations of the experiments. Gains and switches serve both laws; weights, limits and solver belong to the
quadratic program.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from allocation import control_effectiveness
from ibvs_qp.config.contact import BrushSettings, ContactSettings, contact_values
from ibvs_qp.config.contact_margin import require_margin
from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.estimation import AngularRateSettings
from ibvs_qp.config.gains import LAWS, Gains, Weights, scaled_gains
from ibvs_qp.config.limits import LimitSettings, limit_values
from ibvs_qp.config.settings import Checked, choice, derive, dump_toml, load_toml, setting
from ibvs_qp.config.solver import SolverSettings
from ibvs_qp.config.vehicle import VehicleParams

#: No estimator or filter takes a tick to last longer than this [s]: after a pause they go on from where they were.
LONGEST_TICK = 0.02


@dataclass(frozen=True, kw_only=True)
class ControllerConfig(Checked):
    """Configuration of a controller; the default is the Tarot T960."""

    vehicle: VehicleParams = field(default_factory=VehicleParams)
    gains: Gains = field(default_factory=Gains)
    angular_rate: AngularRateSettings = field(default_factory=AngularRateSettings)
    contact: ContactSettings = field(default_factory=ContactSettings)
    weights: Weights = field(default_factory=Weights)
    limits: LimitSettings = field(default_factory=LimitSettings)
    solver: SolverSettings = field(default_factory=SolverSettings)
    brush: BrushSettings = field(default_factory=BrushSettings)
    gains_of: str = choice(
        "qp", "law whose tuned gains, scaled to the vehicle, are the defaults; a pilot sets its own", LAWS
    )
    line_profile: str = choice(
        "tip", "point of the line error: where the tip meets the wall, or the paper's image centre", ("tip", "paper")
    )
    analytic_line_point: str = choice(
        "tip",
        "the same of the analytic law: where the tip meets the wall, or rho at the image centre, as printed",
        ("tip", "centre"),
    )
    analytic_angle_row: bool = setting(
        False, "angle row of the analytic law, as printed; without it the level rows fix roll, with a third of its peak"
    )
    line_slots: int = setting(3, "lines the fixed program has room for; each costs 500 instructions", low=1, high=16)
    tick_s: float = setting(0.004, "control period; beyond 0.02 s it is a pause", "s", 0.0005, LONGEST_TICK)
    impedance: bool = setting(True, "impedance terms of the force law (False: direct force control)")
    contact_feedforward: bool = setting(True, "feed the measured contact moment and expected friction forward")
    touch_ramp: bool = setting(True, "ramp lambda and the force reference after touch")
    reach_check: bool = setting(True, "reduce a push that the vehicle cannot hold")
    barriers: bool = setting(True, "all barriers; each has its own switch in limits")
    thrust_rows: bool = setting(
        True, "thrust limits as rows of the program (False: its thrusts are clipped afterwards)"
    )
    allocator: str = choice(
        "clip",
        "allocator of the analytic law: the paper's clipping, sequential desaturation, or bounded least squares",
        ("clip", "sequential", "box"),
    )

    def __post_init__(self) -> None:
        """Derive settings from the vehicle, and validate: it is fully actuated, and a push can begin."""
        super().__post_init__()
        object.__setattr__(self, "gains", derive(self.gains, scaled_gains(self.vehicle, self.gains_of)))
        object.__setattr__(self, "contact", derive(self.contact, contact_values(self.vehicle)))
        object.__setattr__(self, "limits", derive(self.limits, limit_values(self.vehicle, self.limits.view_margin)))
        matrix = control_effectiveness(self.vehicle.geometry)
        if (rank := int(np.linalg.matrix_rank(matrix))) < len(matrix):
            needed = f"they give {rank} of 6 directions of a wrench; 'ibvs-qp vehicle FILE' names the others"
            raise out_of_range("vehicle.geometry", self.vehicle.geometry.count, "rotors", needed)
        arm = round(self.vehicle.contact_depth_m, 9)
        if self.contact.depth_min_m < arm:
            allowed = f"allowed is at least {arm:g} m, where the camera is when the tip touches"
            raise out_of_range("contact.depth_min_m", self.contact.depth_min_m, "m", allowed)

    def on_backend(self, backend: str) -> ControllerConfig:
        """The same configuration with another solver backend."""
        return dataclasses.replace(self, solver=dataclasses.replace(self.solver, backend=backend))

    @property
    def compiled(self) -> bool:
        """Whether the equations become machine code as well."""
        return self.solver.backend == "compiled"

    @classmethod
    def from_toml(cls, file: str | Path) -> ControllerConfig:
        """Read a preset; ConfigError names field, value, unit and allowed range, also where the contact would ring."""
        config = load_toml(cls, file)
        require_margin(config, config.brush, f"{file}: ")
        return config

    def to_toml(self, *, derived: bool = False) -> str:
        """Write the configuration as TOML text; with ``derived`` also the derived values, for a record."""
        return dump_toml(self, derived=derived)
