"""Decisions as expressions: every branch is computed, the condition selects."""

from __future__ import annotations

import functools

import casadi as ca

Number = ca.SX | ca.DM | float


def where(condition: ca.SX, then: Number, otherwise: Number) -> ca.SX:
    """The first of two expressions where a condition holds, else the second; what is not selected may be NaN."""
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
