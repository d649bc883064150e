"""Rival control laws for the comparison: strict priorities, and prediction; no part of the shipped controller."""

from __future__ import annotations

from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import out_of_range
from ibvs_qp.pilot import Controller
from sim.rivals.horizon import MpcSettings
from sim.rivals.lexicographic import LexicographicController
from sim.rivals.mpc import MpcController

#: Control law by name.
RIVALS = {"lexicographic": LexicographicController, "mpc": MpcController}


def rival_controller(name: str, config: ControllerConfig, settings: MpcSettings | None = None) -> Controller:
    """The control law of a name.

    Args:
        name: Key of `RIVALS`.
        config: Configuration of the controller.
        settings: Of the predictive law; its own without any.

    Raises:
        ConfigError: When there is no such law.
    """
    if name not in RIVALS:
        raise out_of_range("rival", name, "", f"allowed are {', '.join(RIVALS)}")
    return MpcController(config, settings) if name == "mpc" else RIVALS[name](config)
