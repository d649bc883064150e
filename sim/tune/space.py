"""Search space of a law: the gains that both laws have in common, or the weights of the predictive rival."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field

from ibvs_qp.config.contact_margin import STIFFNESS_RATIOS, contact_sensitivity, require_margin
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.gains import gain_factors
from ibvs_qp.config.settings import dump_toml
from ibvs_qp.model.motion_margin import LAG_RATIOS, LARGEST_SENSITIVITY, LARGEST_WITH_OTHER_LAG, motion_sensitivity
from ibvs_qp.pilot import PilotConfig
from sim.rivals.prediction import MpcSettings

#: The predictive rival, as a law that is searched.
RIVAL = "mpc"
#: Search range of every gain, both laws alike: [low, high], logarithmic, linear from 0. About a decade around flying
#: gains. Leads go from none to twice the lag of the Tarot's motors, filters to a third of it.
GAIN_RANGES = {
    "line_kp": (4.0, 400.0),
    "line_kd": (3.0, 60.0),
    "line_ki": (0.5, 15.0),
    "line_lead_s": (0.0, 0.115),
    "line_filter_s": (0.0, 0.02),
    "theta_kp": (0.0, 60.0),
    "theta_kd": (0.0, 16.0),
    "body_rotation_gain": (0.1, 1.0),
    "velocity_kp": (1.0, 8.0),
    "velocity_ki": (0.3, 6.0),
    "velocity_lead_s": (0.0, 0.115),
    "velocity_filter_s": (0.0, 0.02),
    "attitude_kp": (15.0, 400.0),
    "attitude_kd": (6.0, 80.0),
    "attitude_filter_s": (0.0, 0.02),
    "yaw_kp": (8.0, 300.0),
    "yaw_kd": (4.0, 60.0),
    "yaw_filter_s": (0.0, 0.02),
    "force_ksp": (10.0, 300.0),
    "force_ksd": (30.0, 250.0),
    "force_kfp": (0.0, 1.0),
    "push_filter_s": (0.0, 0.02),
}
#: The same of the one weight of the QP that acts without an active limit: it spreads a change of thrust over ticks.
SMOOTHNESS = {"smoothness": (1e-3, 1.0)}
#: The same of the rival's weights: up to a decade to both sides of the first ones, which were set by hand.
WEIGHT_RANGES = {
    "line": (4e3, 4e5),
    "line_rate": (65.0, 6.5e3),
    "height": (1.0, 40.0),
    "velocity": (40.0, 4e3),
    "normal": (0.01, 1.0),
    "tilt": (5e3, 5e5),
    "tilt_rate": (50.0, 5e3),
    "yaw": (2.5e3, 2.5e5),
    "yaw_rate": (50.0, 5e3),
    "terminal": (1.0, 30.0),
    "thrust_change": (0.4, 40.0),
}
#: Gains of roll, pitch, yaw and lines that were near the bound of their loops without leads and filters: a softer start
#: of both laws.
BY_HAND = {
    "line_kp": 60.0,
    "line_kd": 20.0,
    "attitude_kp": 80.0,
    "attitude_kd": 22.0,
    "yaw_kp": 60.0,
    "yaw_kd": 18.0,
}
#: Fragility of an unstable loop [-]: a sensitivity peak of 15.
UNSTABLE = 2.0
#: Significant digits of a value, so that the written preset equals the flown one.
DIGITS = 4

#: Values by name.
Values = dict[str, float]
#: Range of every searched value.
Spans = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class Subject:
    """Configuration of a trial: a preset, or the predictive rival on it."""

    config: PilotConfig
    rival: bool = False
    weights: MpcSettings = field(default_factory=MpcSettings)  # of the rival

    @property
    def values(self) -> Values:
        """The present values of the searched settings."""
        if self.rival:
            return {name: getattr(self.weights, name) for name in self.spans}
        controller = self.config.controller
        return {
            name: getattr(controller.weights if name in SMOOTHNESS else controller.gains, name) for name in self.spans
        }

    @property
    def spans(self) -> Spans:
        """Ranges for the vehicle: a lighter one than the Tarot has a lighter impedance."""
        if self.rival:
            return WEIGHT_RANGES
        mass = min(1.0, gain_factors(self.config.controller.vehicle)[0])
        impedance = {name: GAIN_RANGES[name] for name in ("force_ksp", "force_ksd")}
        scaled = {name: (mass * low, high) for name, (low, high) in impedance.items()}
        return GAIN_RANGES | scaled | (SMOOTHNESS if self.config.law == "qp" else {})

    def having(self, values: Values) -> Subject:
        """The same with other values."""
        if self.rival:
            return dataclasses.replace(self, weights=dataclasses.replace(self.weights, **values))
        of_weights = {name: value for name, value in values.items() if name in SMOOTHNESS}
        of_gains = {name: value for name, value in values.items() if name not in SMOOTHNESS}
        controller = self.config.controller
        controller = dataclasses.replace(
            controller,
            gains=dataclasses.replace(controller.gains, **of_gains),
            weights=dataclasses.replace(controller.weights, **of_weights),
        )
        return dataclasses.replace(self, config=dataclasses.replace(self.config, controller=controller))

    def fragility(self) -> float:
        """Logarithm by which sensitivity peaks exceed their bounds; 0 if none does.

        The peaks are those of the motion, at the nominal lag and others, and of the contact, at the estimated stiffness
        and others. A contact that rings counts as an unstable loop. Neither margin describes a horizon, so the rival
        has none.
        """
        if self.rival:
            return 0.0
        controller = self.config.controller
        try:
            require_margin(controller, controller.brush)
        except ConfigError:
            return UNSTABLE
        peaks = [(max(motion_sensitivity(controller).values()), LARGEST_SENSITIVITY)]
        peaks += [(contact_sensitivity(controller), LARGEST_SENSITIVITY)]
        peaks += [(contact_sensitivity(controller, each), LARGEST_WITH_OTHER_LAG) for each in STIFFNESS_RATIOS]
        peaks += [(max(motion_sensitivity(controller, each).values()), LARGEST_WITH_OTHER_LAG) for each in LAG_RATIOS]
        return min(max(max(math.log(peak / bound) for peak, bound in peaks), 0.0), UNSTABLE)

    def to_toml(self) -> str:
        """The preset, or the rival's settings."""
        return dump_toml(self.weights) if self.rival else self.config.to_toml()


def rounded(values: Values) -> Values:
    """Values with the digits of a preset."""
    return {name: float(f"{value:.{DIGITS}g}") for name, value in values.items()}


def to_unit(value: float, low: float, high: float) -> float:
    """Place of a value in its range, logarithmic, or linear from 0 [-]."""
    return math.log(value / low) / math.log(high / low) if low > 0.0 else value / high


def from_unit(place: float, low: float, high: float) -> float:
    """Value at a place in a range."""
    return min(low * (high / low) ** place if low > 0.0 else high * place, high)
