"""Variants of the controller: ablations by name; everything else is the shipped preset."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import ibvs_qp
from ibvs_qp.config import AngularRateSettings
from ibvs_qp.config.files import read_toml
from ibvs_qp.config.settings import from_dict
from ibvs_qp.pilot import PilotConfig

#: The gyro in full, and no lead.
GYRO_ITSELF = AngularRateSettings(gyro_bandwidth_hz=1000.0, lead_s=0.0)


@dataclass(frozen=True, kw_only=True)
class Variant:
    """A named change of the controller; ``variants.toml`` lists them."""

    words: str  # differences, for tables
    switches: dict[str, bool | str] = field(default_factory=dict)  # fields of ControllerConfig
    gains: dict[str, float] = field(default_factory=dict)  # gains that differ
    gains_of: str = ""  # law whose shipped gains it flies; empty for its own
    gyro_rate: bool = False  # whether rotation is damped on the gyro itself
    controller: str = ""  # class of a control law in place of the law, as in FlightOptions
    rows: tuple[str, ...] = ()  # classes of further tasks and limits, as in FlightOptions
    vision: str = "own"  # perception of rendered pictures, as in FlightOptions
    laws: tuple[str, ...] = ("qp", "paper")  # laws that it applies to
    against: tuple[str, ...] = ("standard",)  # reference variants: the first that flew the same cell

    def apply(self, config: PilotConfig) -> PilotConfig:
        """The configuration with the switches set."""
        changes: dict[str, Any] = dict(self.switches)
        if self.gains_of or self.gains:
            gains = ibvs_qp.preset(self.gains_of).controller.gains if self.gains_of else config.controller.gains
            changes["gains"] = dataclasses.replace(gains, **self.gains)
        if self.gyro_rate:
            changes["angular_rate"] = GYRO_ITSELF
        return dataclasses.replace(config, controller=dataclasses.replace(config.controller, **changes))


VARIANTS = {
    name: from_dict(Variant, table, name)
    for name, table in read_toml(Path(__file__).with_name("variants.toml")).items()
}


def with_force_gain(config: PilotConfig, factor: float) -> PilotConfig:
    """The pilot with stiffer force feedback: gains of direct control times a factor less one, on top of its own."""
    gains = config.controller.gains
    more = {name: getattr(gains, name) + (factor - 1.0) * gain for name, gain in VARIANTS["direct"].gains.items()}
    gains = dataclasses.replace(gains, **more)
    return dataclasses.replace(config, controller=dataclasses.replace(config.controller, gains=gains))
