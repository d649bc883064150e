"""Ablations: what of the controller is switched differently, by name; everything else is the shipped preset."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

from ibvs_qp.config import Gains
from ibvs_qp.pilot import PilotConfig


@dataclass(frozen=True, kw_only=True)
class Variant:
    """A named change of the controller's switches.

    Attributes:
        words: What is different, for tables.
        switches: Fields of `ControllerConfig` and their values.
        vision: Perception of rendered pictures, as in `FlightOptions`.
        laws: Laws for which it makes sense.
        against: Variants that it is judged against: the first that flew the same cell.
    """

    words: str
    switches: dict[str, Any] = field(default_factory=dict)
    vision: str = "own"
    laws: tuple[str, ...] = ("qp", "paper")
    against: tuple[str, ...] = ("standard",)

    def apply(self, config: PilotConfig) -> PilotConfig:
        """The configuration with the switches set."""
        if not self.switches:
            return config
        return dataclasses.replace(config, controller=dataclasses.replace(config.controller, **self.switches))


def with_force_gain(config: PilotConfig, factor: float) -> PilotConfig:
    """The pilot with the force gains K_fp and K_fi multiplied."""
    gains = config.controller.gains
    gains = dataclasses.replace(gains, force_kfp=factor * gains.force_kfp, force_kfi=factor * gains.force_kfi)
    return dataclasses.replace(config, controller=dataclasses.replace(config.controller, gains=gains))


VARIANTS = {
    "standard": Variant(words="as shipped: each law at gains tuned alike, with ramp, feed-forward and reach check"),
    "direct": Variant(words="direct force control, no impedance", switches={"impedance": False}),
    "printed": Variant(
        words="the analytic law as printed (corrected signs only): no ramp after touch, no contact feed-forward",
        switches={"touch_ramp": False, "contact_feedforward": False, "reach_check": False},
        laws=("paper",),
    ),
    "shared-gains": Variant(
        words="one set of gains for both laws, that of the QP", switches={"gains": Gains()}, laws=("paper",)
    ),
    "no-feedforward": Variant(words="no contact feed-forward", switches={"contact_feedforward": False}),
    "no-ramp": Variant(words="no ramp after touch", switches={"touch_ramp": False}),
    "no-barriers": Variant(words="no barriers", switches={"barriers": False}, laws=("qp",)),
    "clipped": Variant(
        words="a program without rotor limits, its thrusts clipped afterwards, no reach check",
        switches={"thrust_rows": False, "reach_check": False},
        laws=("qp",),
        against=("no-reach-check", "standard"),
    ),
    "paper-lines": Variant(
        words="line rows of the QP at the image centre, as in the paper, instead of at the tip",
        switches={"line_profile": "paper"},
        laws=("qp",),
    ),
    "paper-vision": Variant(
        words="the paper's vision: normal picture, Canny and Hough, topmost level line and first upright one",
        vision="paper",
    ),
    "no-reach-check": Variant(words="asked push not reduced to the reach", switches={"reach_check": False}),
}
#: What each variant is judged against.
REFERENCES = {name: variant.against for name, variant in VARIANTS.items()}
