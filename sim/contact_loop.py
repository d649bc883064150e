r"""Predicted damping of the push loop: a mass on a spring, pushed by a delayed controller; the line over the map.

Along the wall normal :math:`m\ddot x = F - f`, :math:`f = k x + b \dot x`, and F is what the force law asks, after the
motor lag. The measured force is late by the sensor's delay and its filter; the rate of the tip comes from the
accelerometer and is not. Delays enter as second-order Padé terms, and the poles of the closed loop say the rest.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.polynomial import Polynomial

from sim.closed_loop import default_preset
from sim.scene import WallScene

#: The softening of K_fp on walls stiffer than this [N/m] (`ibvs_qp.setpoints`).
NOMINAL_STIFFNESS = 1500.0


def _delay(seconds: float) -> tuple[Polynomial, Polynomial]:
    """Second-order Padé approximation of a delay, numerator and denominator."""
    a, b = seconds / 2.0, seconds**2 / 12.0
    return Polynomial([1.0, -a, b]), Polynomial([1.0, a, b])


def loop_poles(law: str, gain: float, stiffness: float, delay_s: float, impedance: bool) -> np.ndarray:
    """Poles of the push loop in steady contact [rad/s].

    Args:
        law: Whose shipped gains.
        gain: Factor on K_fp and K_fi.
        stiffness: Of the wall [N/m].
        delay_s: Of the force/torque sensor [s].
        impedance: Whether the impedance terms act.
    """
    controller = default_preset(law).controller
    gains, vehicle = controller.gains, controller.vehicle
    softness = min(1.0, NOMINAL_STIFFNESS / stiffness)
    kfp, kfi = gain * softness * gains.force_kfp, gain * gains.force_kfi
    ksp, ksd = (gains.force_ksp, gains.force_ksd) if impedance else (0.0, 0.0)
    lag = 0.5 * (vehicle.motor_lag_up_s + vehicle.motor_lag_down_s)
    pole = 1.0 / (2.0 * math.pi * controller.contact.force_filter_hz)
    late, early = _delay(delay_s + controller.tick_s)
    s = Polynomial([0.0, 1.0])
    wall = Polynomial([stiffness, WallScene().damping_n_s_m])
    motion = Polynomial([stiffness, WallScene().damping_n_s_m, vehicle.mass_kg])
    slow, filtered = Polynomial([1.0, lag]), Polynomial([1.0, pole])
    # m x'' + f = F / (1 + lag s), F = -(kfp + kfi/s) f late / (early filtered) - (ksp + ksd s) x
    common = s * early * filtered
    characteristic = motion * slow * common + Polynomial([ksp, ksd]) * common + (kfp * s + kfi) * wall * late
    return characteristic.roots()


@functools.lru_cache(maxsize=4096)
def damping_ratio(law: str, gain: float, stiffness: float, delay_s: float, impedance: bool) -> float:
    """Least damping ratio of the push loop; below zero it oscillates ever more. Arguments as for `loop_poles`."""
    poles = loop_poles(law, gain, stiffness, delay_s, impedance)
    poles = poles[np.abs(poles) > 1e-9]
    return float(np.min(-np.real(poles) / np.abs(poles)))
