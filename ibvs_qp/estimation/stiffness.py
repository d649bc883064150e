"""Stiffness of brush and wall: by swings of the push, and by the planes of the depth camera after a touch."""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from ibvs_qp.config import ContactSettings
from ibvs_qp.config.contact import ContactEstimationSettings
from ibvs_qp.symbolic.logic import both, either, no, where
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
#: The stiffness is measured once the compliance is known to this part. A stiff wall moves the tip by less than the
#: accelerometer's drift, and its compliance is never known to a half: it counts as measured while its compliance, one
#: deviation added, is positive and less than this many times the assumed one, from half the prior deviation on.
KNOWN_PART, STIFF_PART = 0.5, 3.0
#: The result is on the stiff side by so many standard deviations [-]: with an estimate below a third of the true
#: stiffness the loop is unstable.
STIFF_SIDE = 0.5
#: The push rises by this much since the touch before a plane counts [N].
LEAST_RISE = 0.5
#: A touch begins to count at this push [N]: less may be a sensor that drifted, before the wall.
BEGIN_N = 1.0
#: Planes count for this long from then on [s], and so many are needed.
TOUCH_S, LEAST_PLANES = 3.0, 30
#: Their scatter is at most this many times that of the depth camera [-]: a plane of another surface spoils the touch.
MOST_SCATTER = 1.8
#: The compliance is at most this many times that of the softest brush [-]: the touch of 1 kN/m errs by a half.
MOST_COMPLIANCE = 2.0


class Compliance(NamedTuple):
    """Compliance [m/N] and its information, the inverse variance [N^2/m^2]; zero before the first measurement."""

    value: ca.SX
    weight: ca.SX


class MeasuredDistance(NamedTuple):
    """Distance of the tip from the wall: by the plane of one tick, and by the distance filter."""

    accepted: ca.SX  # whether a plane was accepted in this tick
    measured: ca.SX  # distance by that plane alone [m]
    distance: ca.SX  # distance by the filter [m]
    variance: ca.SX  # of the filtered distance [m^2]
    set_anew: ca.SX  # whether the filtered distance was set in this tick, instead of corrected


def touch_compliance(
    signals: Signals,
    settings: ContactEstimationSettings,
    plane: MeasuredDistance,
    *,
    dt: ca.SX,
    push: ca.SX,
    touching: ca.SX,
    softest_n_m: float,
) -> Compliance:
    r"""Compliance by the planes of the last whole touch.

    .. math::
        d_0 - d_i = c\,(f_i - f_0) + b + e_i, \quad b \sim \mathcal N(0, P), \quad e_i \sim \mathcal N(0, \sigma^2)

    d_0 and f_0 are the filtered distance and the push at the touch, d_i and f_i those of a plane. The error b of d_0
    has the variance P of the distance filter, at least that of one plane, and is integrated out: more planes do not
    reduce it. The compliance lies on the stiff side by `STIFF_SIDE` deviations and is at least the assumed one. A touch
    does not count if it ends early, its distance is set anew, its planes scatter, or it seems far softer than the
    softest brush.

    Args:
        signals: Registry.
        settings: Noise of a plane and assumed stiffness.
        plane: Distance of the tip.
        dt: Time since the last tick [s].
        push: Filtered push [N].
        touching: Whether the tip touches.
        softest_n_m: Stiffness of the softest brush [N/m]: more penetration is another surface's plane.
    """
    names = ("time", "distance", "push", "error", "count", "rise", "depth", "rise_2", "product", "depth_2")
    time, first_distance, first_push, error, *sums = (signals.state(f"touch_planes.{name}") for name in names)
    begins = both(touching, time <= 0.0, push > BEGIN_N)
    first_distance, first_push = where(begins, plane.distance, first_distance), where(begins, push, first_push)
    variance = settings.distance_std_m**2
    error = where(begins, ca.fmax(plane.variance, variance) / variance, error)
    rise, depth = push - first_push, first_distance - plane.measured
    counts = both(touching, plane.accepted, time > 0.0, time < TOUCH_S, rise > LEAST_RISE)
    steps = 1.0, rise, depth, rise**2, rise * depth, depth**2
    sums = [where(begins, 0.0, total) + where(counts, step, 0.0) for total, step in zip(sums, steps, strict=True)]
    spoilt = both(plane.set_anew, time > 0.0)
    later = where(either(begins, time > 0.0), where(spoilt, 2.0 * TOUCH_S, time + dt), 0.0)
    later = where(touching, later, 0.0)
    for name, value in zip(names, (later, first_distance, first_push, error, *sums), strict=True):
        signals.remember(f"touch_planes.{name}", value)

    count, rise, depth, rise_2, product, depth_2 = sums
    share = error / (1.0 + error * count)
    weight = (rise_2 - share * rise**2) / variance
    compliance = (product - share * rise * depth) / variance / ca.fmax(weight, 1.0)
    compliance = ca.fmax(compliance - STIFF_SIDE / ca.sqrt(ca.fmax(weight, 1.0)), 1.0 / settings.assumed_stiffness_n_m)
    mean = 1.0 / ca.fmax(count, 1.0)
    across = product - mean * rise * depth
    scatter = depth_2 - mean * depth**2 - across**2 / ca.fmax(rise_2 - mean * rise**2, 1e-6)
    whole = both(touching, time < TOUCH_S, later >= TOUCH_S, no(spoilt), count >= LEAST_PLANES)
    valid = both(whole, scatter * mean < MOST_SCATTER**2 * variance, compliance < MOST_COMPLIANCE / softest_n_m)
    weight = where(valid, weight, signals.state("touch_planes.weight"))
    compliance = where(valid, compliance, signals.state("touch_planes.compliance"))
    return Compliance(
        signals.remember("touch_planes.compliance", compliance), signals.remember("touch_planes.weight", weight)
    )


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
    most = compliance + deviation
    stiff = both(touching, most > 0.0, most < STIFF_PART / own.assumed_stiffness_n_m, deviation < 0.5 * COMPLIANCE_STD)
    compliance = ca.fmax(compliance - STIFF_SIDE * deviation, ca.fmin(compliance, 1.0 / own.assumed_stiffness_n_m))
    compliance = ca.fmin(ca.fmax(compliance, 1.0 / own.stiffness_max_n_m), 1.0 / own.stiffness_min_n_m)
    known = either(signals.state("stiffness.known"), found)
    old = signals.state("stiffness.value", start=own.assumed_stiffness_n_m)
    value = signals.remember("stiffness.value", where(touching, 1.0 / compliance, old))
    return Stiffness(value, either(signals.remember("stiffness.known", known), stiff))  # the next place may be soft
