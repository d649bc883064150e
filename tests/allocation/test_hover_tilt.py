"""Least tilt of a hover against a linear program, and for rotors that are lost, stuck or weak."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from allocation import TAROT_T960, WrenchFacets, control_effectiveness, least_hover_tilt

WEIGHT = 6.0 * 9.80665
FACETS = WrenchFacets(TAROT_T960)
LOWER, UPPER = np.full(6, 1.2), np.full(6, 52.56)


def stuck(rotor, thrust):
    lower, upper = LOWER.copy(), UPPER.copy()
    lower[rotor] = upper[rotor] = thrust
    return lower, upper


def exists(tilt, lower, upper, hold_yaw):
    """Whether a linear program finds thrusts for a hover at this tilt in any of 24 directions."""
    matrix, rows = control_effectiveness(TAROT_T960), slice(None) if hold_yaw else slice(5)
    for azimuth in np.radians(np.arange(0.0, 360.0, 15.0)):
        across = WEIGHT * math.sin(math.radians(tilt))
        down = -WEIGHT * math.cos(math.radians(tilt))
        wrench = np.array((across * math.cos(azimuth), across * math.sin(azimuth), down, 0.0, 0.0, 0.0))
        found = linprog(np.zeros(6), A_eq=matrix[rows], b_eq=wrench[rows], bounds=np.column_stack((lower, upper)))
        if found.status == 0:
            return True
    return False


def test_sound_rotors_hover_level():
    assert least_hover_tilt(FACETS, WEIGHT, LOWER, UPPER, hold_yaw=True) == 0.0
    assert least_hover_tilt(FACETS, WEIGHT, LOWER, UPPER, centre=(0.03, -0.03, 0.0), hold_yaw=True) == 0.0


@pytest.mark.parametrize("rotor", [0, 2, 3])
def test_a_lost_rotor_leaves_a_tilted_hover_that_turns(rotor):
    lower, upper = stuck(rotor, 0.0)
    tilt = least_hover_tilt(FACETS, WEIGHT, lower, upper)
    assert 0.0 < tilt < 3.0
    assert exists(tilt + 0.5, lower, upper, hold_yaw=False) and not exists(tilt - 0.5, lower, upper, hold_yaw=False)
    assert least_hover_tilt(FACETS, WEIGHT, lower, upper, hold_yaw=True) == math.inf


def test_a_stuck_rotor_is_carried_up_to_some_thrust():
    tilts = [least_hover_tilt(FACETS, WEIGHT, *stuck(0, thrust)) for thrust in (8.0, 15.0, 20.0, 30.0, 45.0)]
    assert tilts == [0.0, 0.0, 0.0, math.inf, math.inf]
    assert not exists(20.0, *stuck(0, 45.0), hold_yaw=False)


def test_weak_rotors_hover_as_long_as_their_lift_suffices():
    # Hover takes 11.33 N of each rotor: 21.6 % of the full thrust.
    assert least_hover_tilt(FACETS, WEIGHT, LOWER, 0.25 * UPPER, hold_yaw=True) == 0.0
    assert least_hover_tilt(FACETS, WEIGHT, LOWER, 0.21 * UPPER) == math.inf
    # With the weight 0.1 m ahead the front rotors need more than they have.
    assert least_hover_tilt(FACETS, WEIGHT, LOWER, 0.25 * UPPER, centre=(0.1, 0.0, 0.0)) == math.inf
