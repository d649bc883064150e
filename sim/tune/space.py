"""Search space: the gains that both laws have in common, each over a logarithmic range."""

from __future__ import annotations

import dataclasses

from ibvs_qp.config.gain_scaling import gain_factors
from ibvs_qp.pilot import PilotConfig

#: Search range of every gain, both laws alike: [low, high] on a logarithmic scale, about a decade around flying gains.
RANGES = {
    "line_kp": (4.0, 400.0),
    "line_kd": (3.0, 60.0),
    "line_ki": (0.5, 15.0),
    "theta_kp": (4.0, 60.0),
    "theta_kd": (3.0, 16.0),
    "body_rotation_gain": (0.1, 1.0),
    "velocity_kp": (1.0, 8.0),
    "velocity_ki": (0.3, 6.0),
    "attitude_kp": (15.0, 400.0),
    "attitude_kd": (6.0, 80.0),
    "yaw_kp": (8.0, 300.0),
    "yaw_kd": (4.0, 60.0),
    "force_ksp": (10.0, 300.0),
    "force_ksd": (30.0, 250.0),
    "force_kfp": (0.05, 1.0),
    "force_kfi": (0.4, 5.0),
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
#: Significant digits of a gain, so that the written preset equals the flown one.
DIGITS = 4


def ranges(config: PilotConfig) -> dict[str, tuple[float, float]]:
    """`RANGES` for a vehicle: a lighter one than the Tarot has a lighter impedance."""
    mass = min(1.0, gain_factors(config.controller.vehicle)[0])
    scaled = {name: (mass * low, high) for name, (low, high) in RANGES.items() if name in ("force_ksp", "force_ksd")}
    return RANGES | scaled


def rounded(gains: dict[str, float]) -> dict[str, float]:
    """Gains with the digits of a preset."""
    return {name: float(f"{value:.{DIGITS}g}") for name, value in gains.items()}


def with_gains(config: PilotConfig, gains: dict[str, float]) -> PilotConfig:
    """The pilot with other gains."""
    controller = dataclasses.replace(config.controller, gains=dataclasses.replace(config.controller.gains, **gains))
    return dataclasses.replace(config, controller=controller)


def searched_gains(config: PilotConfig) -> dict[str, float]:
    """The present values of the searched gains."""
    return {name: getattr(config.controller.gains, name) for name in RANGES}
