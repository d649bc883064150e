"""Rival control laws for the comparison: strict priorities, and prediction; no part of the shipped controller."""

from __future__ import annotations

from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import out_of_range
from ibvs_qp.pilot import Controller
from sim.rivals.lexicographic import LexicographicController
from sim.rivals.mpc import MpcController

#: Control law by name.
RIVALS = {"lexicographic": LexicographicController, "mpc": MpcController}


def rival_controller(name: str, config: ControllerConfig) -> Controller:
    """The control law of a name.

    Raises:
        ConfigError: When there is no such law.
    """
    if name not in RIVALS:
        raise out_of_range("rival", name, "", f"allowed are {', '.join(RIVALS)}")
    return RIVALS[name](config)
