"""Speed along a stroke and a climb: ramps, and braking that ends at the target."""

from __future__ import annotations

import math

from ibvs_qp.pilot.painting.config import PaintingConfig

#: Braking may be this many times faster than the acceleration.
BRAKING_RATIO = 2.0
#: The last millimetres of a stroke: distance to speed [1/s], and least speed [m/s] that still reaches the end.
STROKE_END_GAIN, STROKE_CREEP = 2.0, 0.005
#: Least speed that still reaches the end of a climb [m/s].
CLIMB_CREEP = 0.002


def stroke_speed(config: PaintingConfig, remaining: float) -> float:
    """Speed along a stroke [m/s] with that much of it left [m]."""
    left = remaining if remaining > 0.0 else 0.0
    braking = math.sqrt(2.0 * config.acceleration_m_s2 * left)
    return min(config.speed_m_s, braking, STROKE_END_GAIN * left + STROKE_CREEP)


def climb_speed(config: PaintingConfig, remaining: float) -> float:
    """Speed of a climb [m/s] with that much of it left [m]."""
    braking = math.sqrt(2.0 * config.acceleration_m_s2 * max(remaining, 0.0))
    return min(config.climb_speed_m_s, braking + CLIMB_CREEP)


def ramped(speed: float, target: float, step: float) -> float:
    """Speed one tick later on its way to a target [m/s]; it increases by at most ``step`` [m/s]."""
    return speed + clipped(target - speed, -BRAKING_RATIO * step, step)


def clipped(value: float, low: float, high: float) -> float:
    """The value within its bounds; plain comparisons cost a fraction of calls of min and max."""
    return low if value < low else high if value > high else value


def approached(now: float, target: float, step: float) -> float:
    """A value one step nearer to its target."""
    return now + clipped(target - now, -step, step)
