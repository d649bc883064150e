"""Settings of the controller: frozen dataclasses with unit, range and reason of every number, read from TOML."""

from ibvs_qp.config.angular_rate import AngularRateSettings
from ibvs_qp.config.brush import BrushSettings
from ibvs_qp.config.contact import ContactSettings
from ibvs_qp.config.contact_estimation import ContactEstimationSettings
from ibvs_qp.config.controller import LONGEST_TICK, ControllerConfig
from ibvs_qp.config.errors import ConfigError, IbvsQpError
from ibvs_qp.config.estimation import EstimationConfig
from ibvs_qp.config.gains import Gains
from ibvs_qp.config.limits import LimitSettings
from ibvs_qp.config.safety import SafetySettings
from ibvs_qp.config.solver import SolverSettings
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.config.weights import Weights

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
