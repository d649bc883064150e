"""Decisions as expressions: every branch is computed, the condition selects."""

from __future__ import annotations

import functools
import math

import casadi as ca

Number = ca.SX | ca.DM | float


def where(condition: ca.SX, then: Number, otherwise: Number) -> ca.SX:
    """The first of two expressions where a condition holds, else the second; the other may be NaN."""
    return ca.if_else(condition, then, otherwise)


def both(*conditions: ca.SX) -> ca.SX:
    """Whether all conditions hold."""
    return functools.reduce(ca.logic_and, conditions)


def either(*conditions: ca.SX) -> ca.SX:
    """Whether any condition holds."""
    return functools.reduce(ca.logic_or, conditions)


def no(condition: ca.SX) -> ca.SX:
    """Whether a condition does not hold."""
    return ca.logic_not(condition)


def wrapped(angle: ca.SX) -> ca.SX:
    """The same angle within -pi and pi [rad]."""
    return angle - 2.0 * math.pi * ca.floor((angle + math.pi) / (2.0 * math.pi))


def clamp(value: ca.SX, low: float | ca.SX, high: float | ca.SX) -> ca.SX:
    """Value limited to [low, high], entry by entry."""
    return ca.fmin(ca.fmax(value, low), high)
