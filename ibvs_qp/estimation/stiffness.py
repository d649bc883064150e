"""Stiffness of brush and wall, estimated while pressing."""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from ibvs_qp.config import ContactSettings
from ibvs_qp.estimation.touch_compliance import STIFF_SIDE, Compliance
from ibvs_qp.symbolic.logic import both, either, where
from ibvs_qp.symbolic.signals import Signals

#: Push and penetration count above this frequency [rad/s]: below, the twice integrated accelerometer drifts.
BAND = 8.0
#: Standard deviation of the compliance before a press [m/N]: that of 2000 N/m; and the least one of a penetration [m].
COMPLIANCE_STD, LEAST_STD = 5e-4, 1e-4
#: Both start anew where the push is less [N]: a tip that leaves the wall moves on without it.
PRESSED_N = 0.5
#: Swings of the push count for this long [s]: another part of the wall may be softer.
MEMORY_S = 60.0
#: A swing of a touch reaches this [N].
TOUCH_N = 5.0
#: Bandwidth of the mean push [rad/s], below that of any swing that counts.
MEAN = 1.0
#: A push counts from so many standard deviations of its noise [-]: the noise of the regressor alone, for a minute in
#: calm air, makes any wall look stiff.
NOISE_SIGMAS = 3.0
#: The stiffness is measured once the compliance is known to this part.
KNOWN_PART = 0.5


class Stiffness(NamedTuple):
    """Stiffness [N/m], the assumed one until it is known, and whether it was measured."""

    value: ca.SX
    known: ca.SX


def stiffness(
    signals: Signals,
    settings: ContactSettings,
    *,
    dt: ca.SX,
    push: ca.SX,
    push_noise: ca.SX,
    acceleration: ca.SX,
    lever_speed: ca.SX,
    speed: ca.SX,
    variance: ca.SX,
    touching: ca.SX,
    felt: ca.SX,
    by_planes: Compliance,
) -> Stiffness:
    r"""Compliance c = 1/k by Bayesian least squares of penetration on push, both in one band.

    .. math::
        x = \frac{s\,a}{(s + \omega)^3}, \quad y = \frac{s^3}{(s + \omega)^3} f, \quad
        c = \frac{\sum x y / r + c_0 / \sigma_0^2}{\sum y^2 / r + 1 / \sigma_0^2}

    The distance filter holds a tip in contact at the wall, so the penetration is that of the accelerometer alone; r is
    its variance by the accelerometer's noise. Only swings of the push beyond its own noise count. Calm air has none,
    and a slow touch is lost in the accelerometer's drift: the compliance by the planes of the last touch is a second
    measurement.

    Args:
        signals: Registry.
        settings: Force filter and `estimation` settings.
        dt: Time since the last tick [s].
        push: Filtered push [N].
        push_noise: Its standard deviation by the sensor's noise [N].
        acceleration: Of the centre of mass into the wall, without bias [m/s^2].
        lever_speed: Speed of the tip into the wall by the body's rotation [m/s].
        speed: Of the tip into the wall by the distance filter, with which a press begins [m/s].
        variance: Of one sample of the acceleration [m^2/s^4].
        touching: Whether the tip touches.
        felt: Whether there is an accelerometer.
        by_planes: Compliance by the planes of the last touch.
    """
    own = settings.estimation
    names = ("speed", "penetration", "lagged", "push_change", "push_twice", "push_band", "band", "push", "lever")
    tip_speed, penetration, lagged, push_change, push_twice, push_band, band, last_push, last_lever = (
        signals.state(f"stiffness.{name}") for name in names
    )
    weight, product = signals.state("stiffness.weight"), signals.state("stiffness.product")
    keep = ca.exp(-BAND * dt)
    tip_speed = keep * (tip_speed + dt * acceleration + lever_speed - last_lever)
    penetration = keep * (penetration + dt * tip_speed)
    change = keep * (push_change + push - last_push)
    twice = keep * (push_twice + change - push_change)
    push_band = keep * (push_band + twice - push_twice)
    # The same filter as the push, so that both lag alike; once more high-passed, against the accelerometer's bias.
    later = lagged + (1.0 - ca.exp(-2.0 * math.pi * settings.force_filter_hz * dt)) * (penetration - lagged)
    band = keep * (band + later - lagged)
    pressing = both(touching, felt, push > PRESSED_N)
    values = tip_speed, penetration, later, change, twice, push_band, band
    start = speed, *[0.0] * 6
    for name, value, begin in zip(names[:7], values, start, strict=True):
        signals.remember(f"stiffness.{name}", where(pressing, value, begin))
    signals.remember("stiffness.push", push)
    signals.remember("stiffness.lever", lever_speed)
    noise = variance * dt / (16.0 * BAND**3) + LEAST_STD**2
    # A swing beyond the mean push is a spike or a bounce, which the filters forget within three of their times.
    mean = signals.state("stiffness.mean")
    mean = signals.remember("stiffness.mean", where(pressing, mean + (1.0 - ca.exp(-MEAN * dt)) * (push - mean), push))
    since = where(ca.fabs(push_band) < ca.fmax(mean, TOUCH_N), signals.state("stiffness.since", start=1.0) + dt, 0.0)
    since = signals.remember("stiffness.since", since)
    swings = both(pressing, push_band**2 > (NOISE_SIGMAS * push_noise) ** 2, since > 3.0 / BAND)
    counts = where(swings, dt * BAND / noise, 0.0)  # samples within 1/BAND are not independent
    fade = ca.exp(-where(swings, dt, 0.0) / MEMORY_S)
    weight = signals.remember("stiffness.weight", fade * weight + counts * push_band**2)
    product = signals.remember("stiffness.product", fade * product + counts * push_band * band)
    weight, product = weight + by_planes.weight, product + by_planes.weight * by_planes.value
    prior = 1.0 / COMPLIANCE_STD**2
    compliance = (product + prior / own.assumed_stiffness_n_m) / (weight + prior)
    deviation = 1.0 / ca.sqrt(weight + prior)
    found = both(touching, deviation < KNOWN_PART * compliance)
    compliance = ca.fmax(compliance - STIFF_SIDE * deviation, ca.fmin(compliance, 1.0 / own.assumed_stiffness_n_m))
    compliance = ca.fmin(ca.fmax(compliance, 1.0 / own.stiffness_max_n_m), 1.0 / own.stiffness_min_n_m)
    known = either(signals.state("stiffness.known"), found)
    old = signals.state("stiffness.value", start=own.assumed_stiffness_n_m)
    value = signals.remember("stiffness.value", where(touching, 1.0 / compliance, old))
    return Stiffness(value, signals.remember("stiffness.known", known))
