"""Greatest push with a deliberate tilt: figures, a general optimiser, and the wrench set itself at that tilt."""

from __future__ import annotations

import math

import numpy as np
import pytest
from reach_oracle import RIGHT, TIP, WEIGHT
from rotor_layouts import OCTOROTOR
from scipy.spatial.transform import Rotation

from allocation import (
    TAROT_T960,
    WrenchFacets,
    push_reach,
    tilted_push_reach,
    worst_push_reach,
    worst_tilted_push_reach,
)

IDLE, FULL = 1.2, 52.56
LIMITS = WEIGHT, TIP, IDLE, FULL


@pytest.mark.parametrize(
    ("friction", "travel", "tilt_deg", "push"),
    [
        (0.0, None, 2.0, 31.43),
        (0.0, None, 5.0, 32.88),
        (0.3, -RIGHT, 2.0, 19.66),
        (0.8, -RIGHT, 2.0, 10.77),
        (0.8, -RIGHT, 5.0, 14.17),
    ],
)
def test_a_tilt_of_some_degrees_adds_newtons(friction: float, travel, tilt_deg: float, push: float) -> None:
    tilt = math.radians(tilt_deg)
    found, angles = tilted_push_reach(WrenchFacets(TAROT_T960), *LIMITS, tilt=tilt, friction=friction, travel=travel)
    assert found == pytest.approx(push, abs=0.06)
    assert np.abs(angles).max() <= tilt + 1e-9


@pytest.mark.parametrize("layout", [TAROT_T960, OCTOROTOR])
def test_without_tilt_it_is_the_reach_of_a_level_vehicle(layout) -> None:
    facets = WrenchFacets(layout)
    for friction, travel in ((0.0, None), (0.5, RIGHT)):
        level = push_reach(facets, *LIMITS, friction=friction, travel=travel).push
        assert tilted_push_reach(facets, *LIMITS, tilt=0.0, friction=friction, travel=travel)[0] == pytest.approx(level)
    worst = worst_push_reach(facets, *LIMITS, friction=0.3).push
    assert worst <= worst_tilted_push_reach(facets, *LIMITS, tilt=0.0, friction=0.3) <= 1.02 * worst


def test_the_rotors_hold_the_push_at_that_attitude() -> None:
    """Gravity, push and friction in the axes of the tilted body: held up to the push found, and not beyond it.

    No other attitude within the limit holds 0.1 N more.
    """
    facets, limit = WrenchFacets(TAROT_T960), math.radians(2.0)
    push, found = tilted_push_reach(facets, *LIMITS, tilt=limit, friction=0.8, travel=-RIGHT)

    def held(force: float, angles: np.ndarray) -> bool:
        body = Rotation.from_euler("ZYX", (0.0, angles[1], angles[0])).inv()
        direction = body.apply((1.0, 0.0, 0.0) - 0.8 * RIGHT)
        wrench = force * np.concatenate((direction, np.cross(TIP, direction)))
        wrench[:3] -= body.apply((0.0, 0.0, WEIGHT))
        return facets.contains(wrench, IDLE, FULL)

    assert held(0.9999 * push, found) and not held(1.0001 * push, found)
    grid = np.linspace(-limit, limit, 21)
    assert not any([held(push + 0.1, np.array((roll, pitch))) for roll in grid for pitch in grid])


def test_no_push_is_possible_without_a_hover() -> None:
    found, angles = tilted_push_reach(WrenchFacets(TAROT_T960), WEIGHT, TIP, IDLE, 3.0, tilt=0.1)
    assert math.isnan(found) and np.isnan(angles).all()
    assert math.isnan(worst_tilted_push_reach(WrenchFacets(TAROT_T960), WEIGHT, TIP, IDLE, 3.0, tilt=0.1, friction=0.3))
