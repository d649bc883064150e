"""Compliance of brush and wall by the planes of the depth camera after a touch."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca

from ibvs_qp.config.contact import ContactEstimationSettings
from ibvs_qp.symbolic.logic import both, either, no, where
from ibvs_qp.symbolic.signals import Signals

#: The result is on the stiff side by so many standard deviations [-]: a loop that believes in less than a third of the
#: true stiffness is unstable.
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
