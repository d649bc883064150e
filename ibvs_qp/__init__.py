"""Aerial manipulation by one quadratic program per tick: the drop-in controller and its types."""

from allocation import TAROT_T960, RotorGeometry, control_effectiveness
from ibvs_qp.analytic import PaperController
from ibvs_qp.command import ActiveLimit, Command, Outcome, TaskReport
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.errors import ConfigError, IbvsQpError
from ibvs_qp.measurement import (
    FeatureFrame,
    LineFeature,
    LineReference,
    Measurement,
    Reference,
    RgbdFrame,
    SensorFrame,
)
from ibvs_qp.pilot import Pilot, PilotConfig
from ibvs_qp.vehicle import VehicleParams

__all__ = [
    "TAROT_T960",
    "ActiveLimit",
    "Command",
    "ConfigError",
    "ControllerConfig",
    "FeatureFrame",
    "HybridController",
    "IbvsQpError",
    "LineFeature",
    "LineReference",
    "Measurement",
    "Outcome",
    "PaperController",
    "Pilot",
    "PilotConfig",
    "Reference",
    "RgbdFrame",
    "RotorGeometry",
    "SensorFrame",
    "TaskReport",
    "VehicleParams",
    "control_effectiveness",
]
