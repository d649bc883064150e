"""A tip that friction holds in place: the vehicle turns about it, and must do so softly."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from ibvs_qp.config import ControllerConfig
from ibvs_qp.model.feedforward import moment_lag
from ibvs_qp.model.model import Model

#: Used fraction of the largest stable stiffness; closer to it the vehicle rocks about its tip until it slips.
STIFFNESS_FRACTION = 1.0 / 3.0


def pivot_stiffness(config: ControllerConfig, gains: Any = None) -> tuple[Any, Any]:
    r"""Stiffness of pitch and yaw while friction holds the tip and no line fixes its place [1/s^2].

    The vehicle turns about the tip, L ahead. The fed-forward contact moment is T late, and the late part of it is the
    moment of the vehicle's own mass: :math:`J\ddot\psi = J\alpha + T \, d/dt (m L^2 \ddot\psi + L F)`. With
    :math:`\alpha = -K_p \psi - K_d \dot\psi` and :math:`F = -m K_v v`, :math:`v = -L \dot\psi`, Routh's criterion is

    .. math:: K_p < K_d \Big(\frac{J}{m L^2 T} + K_v\Big),

    316 in pitch and 228 in yaw for the shipped vehicle and gains of the program.

    Args:
        config: Vehicle and delay of the feed-forward.
        gains: Numbers or symbols; those of the configuration by default.
    """
    vehicle, gains = config.vehicle, gains or config.gains
    swing = max(vehicle.mass_kg * vehicle.tip_position_m[0] ** 2 * moment_lag(config), 1e-9)
    _, pitch, yaw = vehicle.inertia_kg_m2
    return (
        STIFFNESS_FRACTION * gains.attitude_kd * (pitch / swing + gains.velocity_kp),
        STIFFNESS_FRACTION * gains.yaw_kd * (yaw / swing + gains.velocity_kp),
    )


def pivot_limited(model: Model, stiffness: Any, pivot: Any, guides: Sequence[ca.SX]) -> ca.SX:
    """Stiffness of an axis [1/s^2], reduced while friction alone holds the tip.

    Args:
        model: Lines, tip and switch of the feed-forward.
        stiffness: Of a free vehicle [1/s^2].
        pivot: Of a vehicle that turns about its tip, by `pivot_stiffness` [1/s^2].
        guides: For every line 1 if it fixes the place of the tip across this axis.
    """
    if not model.config.contact_feedforward:
        return ca.SX(stiffness)
    guided = ca.SX(0.0)
    for line, guide in zip(model.lines, guides, strict=True):
        guided = ca.fmax(guided, guide * line.present * line.confidence)
    return stiffness + model.tip_stationary * (1.0 - guided) * (ca.fmin(stiffness, pivot) - stiffness)
