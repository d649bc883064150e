"""Stiffness of brush and wall, estimated while pressing."""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from ibvs_qp.config import ContactSettings
from ibvs_qp.symbolic.logic import both, either, where
from ibvs_qp.symbolic.signals import Signals

#: Samples needed before a slope is computed.
LEAST_SAMPLES = 30
#: Smallest divisor: of the counts [-] and of the covariance [N m].
_LEAST = 1e-30


class Stiffness(NamedTuple):
    """Stiffness [N/m], the assumed one until it is known, and whether it was measured."""

    value: ca.SX
    known: ca.SX


def stiffness(
    signals: Signals,
    settings: ContactSettings,
    push: ca.SX,
    penetration: ca.SX,
    interval: ca.SX,
    touched: ca.SX,
) -> Stiffness:
    """Slope of push against penetration over a press, by least squares with the running means removed.

    At a touch it starts anew; the last estimate remains until a better one exists.

    Args:
        signals: Registry.
        settings: Force filter and `estimation` settings.
        push: Filtered push [N].
        penetration: Of the tip [m].
        interval: Time since the last force sample in contact [s]; 0 when there is no new one.
        touched: Whether a contact begins in this tick, after the sample.
    """
    own = settings.estimation
    value = signals.state("stiffness.value", start=own.assumed_stiffness_n_m)
    known, time, count, depth = (signals.state(f"stiffness.{name}") for name in ("known", "time", "count", "depth"))
    sums = signals.state("stiffness.sums", 4)
    time = time + interval
    counted = both(interval > 0.0, time <= own.stiffness_time_s)
    # The same filter as the push, so that both lag alike.
    gain = where(count > 0.0, 1.0 - ca.exp(-2.0 * math.pi * settings.force_filter_hz * interval), 1.0)
    depth = where(counted, depth + gain * (penetration - depth), depth)
    count = count + where(counted, 1.0, 0.0)
    sample = ca.vertcat(depth, push, depth * push, push * push)
    sums = sums + where(counted, sample, ca.SX.zeros(4))
    x, y, xy, yy = ca.vertsplit(sums / ca.fmax(count, 1.0))
    variance, covariance = yy - y * y, xy - x * y
    # Regress penetration on push: the push is the cleaner signal, so the slope is not biased low.
    pressed = both(counted, variance > own.stiffness_push_spread_n**2, count > LEAST_SAMPLES, covariance > 0.0)
    slope = ca.fmin(ca.fmax(variance / ca.fmax(covariance, _LEAST), own.stiffness_min_n_m), own.stiffness_max_n_m)
    value, known = where(pressed, slope, value), either(known, pressed)
    for name, kept in {"time": time, "count": count, "depth": depth, "sums": sums}.items():
        signals.remember(f"stiffness.{name}", where(touched, 0.0 * kept, kept))
    return Stiffness(signals.remember("stiffness.value", value), signals.remember("stiffness.known", known))
