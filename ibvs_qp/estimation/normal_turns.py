"""Turns of the measured wall normal against those of the gyro: a depth camera with mirrored axes."""

from __future__ import annotations

import math

import casadi as ca

from ibvs_qp.symbolic.logic import both, either, no, where, wrapped
from ibvs_qp.symbolic.signals import Signals

#: Turns are compared over this time [s], and judged once the gyro's have this root sum of squares [rad]: five times
#: the noise of a turn by two normals of 0.6 deg each over the threshold's distance from a right sign.
TURN_S, LEAST_TURN = 0.25, math.radians(3.0)
#: Correlation of both over the gyro's square, below which they oppose each other: 1 right, -1 mirrored.
OPPOSED = -0.5


def mirrored_normal(signals: Signals, new: ca.SX, since_last: ca.SX, normal: ca.SX, yaw: ca.SX) -> ca.SX:
    """Whether the normal turns against the vehicle's yaw; following it would turn the vehicle to the wall's side.

    Args:
        signals: Registry.
        new: Whether a normal was measured in this tick.
        since_last: Time from the capture of the last measured normal to this one's [s].
        normal: The normal in B, (3,).
        yaw: Integrated yaw at its capture [rad].
    """
    names = ("started", "time", "seen", "yaw", "square", "product", "found")
    started, time, first, begun, square, product, found = (signals.state(f"turns.{name}") for name in names)
    seen = -ca.atan2(normal[1], normal[0])  # the wall turns the other way in B
    time = where(started, time + since_last, 0.0)
    due = both(new, started, time >= TURN_S)
    felt, turned = wrapped(yaw - begun), wrapped(seen - first)
    square, product = square + where(due, felt * felt, 0.0), product + where(due, felt * turned, 0.0)
    judged = both(due, square >= LEAST_TURN**2)
    found = either(found, both(judged, product < OPPOSED * square))
    begins = both(new, either(no(started), due))
    kept = {
        "started": either(started, new),
        "time": where(begins, 0.0, where(new, time, signals.state("turns.time"))),
        "seen": where(begins, seen, first),
        "yaw": where(begins, yaw, begun),
        "square": where(judged, 0.0, square),
        "product": where(judged, 0.0, product),
        "found": found,
    }
    for name, value in kept.items():
        signals.remember(f"turns.{name}", value)
    return found
