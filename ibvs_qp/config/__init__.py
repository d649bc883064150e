"""Settings of the controller: frozen dataclasses with unit, range and reason of every number, read from TOML."""

from ibvs_qp.config.contact import BrushSettings, ContactEstimationSettings, ContactSettings
from ibvs_qp.config.controller import LONGEST_TICK, ControllerConfig
from ibvs_qp.config.errors import ConfigError, IbvsQpError
from ibvs_qp.config.estimation import AngularRateSettings, EstimationConfig
from ibvs_qp.config.gains import Gains, Weights
from ibvs_qp.config.limits import LimitSettings
from ibvs_qp.config.safety import SafetySettings
from ibvs_qp.config.solver import SolverSettings
from ibvs_qp.config.vehicle import VehicleParams

__all__ = [
    "LONGEST_TICK",
    "AngularRateSettings",
    "BrushSettings",
    "ConfigError",
    "ContactEstimationSettings",
    "ContactSettings",
    "ControllerConfig",
    "EstimationConfig",
    "Gains",
    "IbvsQpError",
    "LimitSettings",
    "SafetySettings",
    "SolverSettings",
    "VehicleParams",
    "Weights",
]
