"""Aerial manipulation by one quadratic program per tick: the drop-in controller and its types.

The names load on first use: a program that only checks its command line need not wait for solvers and OpenCV.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str

    from allocation import TAROT_T960, RotorGeometry, control_effectiveness
    from ibvs_qp.analytic import PaperController
    from ibvs_qp.command import ActiveLimit, Command, Outcome, SafetyState, TaskReport
    from ibvs_qp.config import ControllerConfig, SafetySettings
    from ibvs_qp.config.errors import ConfigError, IbvsQpError
    from ibvs_qp.config.vehicle import VehicleParams
    from ibvs_qp.controller import HybridController
    from ibvs_qp.measurement import (
        FeatureFrame,
        LineFeature,
        LineReference,
        Measurement,
        Reference,
        RgbdFrame,
        SensorFrame,
    )
    from ibvs_qp.painting.command import PainterInput, PaintingCommand
    from ibvs_qp.painting.strategy import Strategy
    from ibvs_qp.pilot import FlightStatus, Pilot, PilotConfig
    from ibvs_qp.presets import preset
    from ibvs_qp.supervision.assured import Assured

__all__ = [
    "TAROT_T960",
    "ActiveLimit",
    "Assured",
    "Command",
    "ConfigError",
    "ControllerConfig",
    "FeatureFrame",
    "FlightStatus",
    "HybridController",
    "IbvsQpError",
    "LineFeature",
    "LineReference",
    "Measurement",
    "Outcome",
    "PainterInput",
    "PaintingCommand",
    "PaperController",
    "Pilot",
    "PilotConfig",
    "Reference",
    "RgbdFrame",
    "RotorGeometry",
    "SafetySettings",
    "SafetyState",
    "SensorFrame",
    "Strategy",
    "TaskReport",
    "VehicleParams",
    "__version__",
    "control_effectiveness",
    "preset",
]

_HOMES = {
    "allocation": ("TAROT_T960", "RotorGeometry", "control_effectiveness"),
    "ibvs_qp.analytic": ("PaperController",),
    "ibvs_qp.supervision.assured": ("Assured",),
    "ibvs_qp.command": ("ActiveLimit", "Command", "Outcome", "SafetyState", "TaskReport"),
    "ibvs_qp.config.controller": ("ControllerConfig",),
    "ibvs_qp.config.safety": ("SafetySettings",),
    "ibvs_qp.controller": ("HybridController",),
    "ibvs_qp.config.errors": ("ConfigError", "IbvsQpError"),
    "ibvs_qp.painting.command": ("PainterInput", "PaintingCommand"),
    "ibvs_qp.painting.strategy": ("Strategy",),
    "ibvs_qp.pilot": ("FlightStatus", "Pilot", "PilotConfig"),
    "ibvs_qp.config.vehicle": ("VehicleParams",),
    "ibvs_qp.presets": ("preset",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name where it lives."""
    if name == "__version__":
        from importlib.metadata import version

        return version("ibvs-qp")
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME_OF.get(name, "ibvs_qp.measurement")), name)
