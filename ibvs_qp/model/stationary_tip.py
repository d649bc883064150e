"""A tip that friction holds in place: the vehicle turns about it, and must do so softly."""

from __future__ import annotations

from ibvs_qp.config import ControllerConfig
from ibvs_qp.model.feedforward import moment_lag

#: Used fraction of the largest stable stiffness; closer to it the vehicle rocks about its tip until it slips.
STIFFNESS_FRACTION = 1.0 / 3.0


def pivot_stiffness(config: ControllerConfig) -> tuple[float, float]:
    r"""Stiffness of pitch and yaw while friction holds the tip and no line fixes its place [1/s^2].

    The vehicle turns about the tip, L ahead. The fed-forward contact moment is T late, and the late part of it is the
    moment of the vehicle's own mass: :math:`J\ddot\psi = J\alpha + T \, d/dt (m L^2 \ddot\psi + L F)`. With
    :math:`\alpha = -K_p \psi - K_d \dot\psi` and :math:`F = -m K_v v`, :math:`v = -L \dot\psi`, Routh's criterion is

    .. math:: K_p < K_d \Big(\frac{J}{m L^2 T} + K_v\Big),

    26 in pitch and 31 in yaw for the shipped vehicle.
    """
    vehicle, gains = config.vehicle, config.gains
    swing = max(vehicle.mass_kg * vehicle.tip_position_m[0] ** 2 * moment_lag(config), 1e-9)
    _, pitch, yaw = vehicle.inertia_kg_m2
    return (
        STIFFNESS_FRACTION * gains.attitude_kd * (pitch / swing + gains.velocity_kp),
        STIFFNESS_FRACTION * gains.yaw_kd * (yaw / swing + gains.velocity_kp),
    )
