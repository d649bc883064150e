"""Push reach, level and tilted: the published figures, a linear program as oracle, weak and dead rotors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reach_oracle import DOWN, FULL, IDLE, OCTOROTOR, RIGHT, TIP, UPPER, WEIGHT, by_linear_program
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from allocation import (
    TAROT_T960,
    WrenchFacets,
    control_effectiveness,
    hover_wrench,
    push_direction,
    push_reach,
    tilted_push_reach,
    worst_push_reach,
    worst_tilted_push_reach,
)

FACETS = {"six": WrenchFacets(TAROT_T960), "eight": WrenchFacets(OCTOROTOR)}
SIX, LIMITS = FACETS["six"], (WEIGHT, TIP, IDLE, FULL)


def towards(angle_deg: float) -> np.ndarray:
    """Travel in the wall plane, from right towards down."""
    return math.cos(math.radians(angle_deg)) * RIGHT + math.sin(math.radians(angle_deg)) * DOWN


def test_figures_of_the_vehicle() -> None:
    assert push_reach(SIX, *LIMITS).push == pytest.approx(30.4, abs=0.05)
    for friction, sideways, worst in ((0.3, 15.8, 14.4), (0.8, 8.7, 7.6)):
        for travel in (RIGHT, -RIGHT):
            reach = push_reach(SIX, *LIMITS, friction=friction, travel=travel)
            assert reach.push == pytest.approx(sideways, abs=0.06)
        # Sliding down as well unloads the rotors further: the sideways figure is not the worst one.
        found = worst_push_reach(SIX, *LIMITS, friction=friction)
        assert found.push == pytest.approx(worst, abs=0.06)
        scan = [push_reach(SIX, *LIMITS, friction=friction, travel=towards(angle)).push for angle in range(360)]
        assert found.push <= min(scan) and found.push == pytest.approx(min(scan), abs=1e-3)


def weak(rotor: str, ratio: float) -> np.ndarray:
    upper = UPPER.copy()
    upper[TAROT_T960.names.index(rotor)] *= ratio
    return upper


@pytest.mark.parametrize(
    ("upper", "push"),
    [(30.0, 28.0), (25.0, 20.5), (20.0, 13.0), (18.0, 10.0), (15.0, 5.5)]
    + [(weak("mid_right", ratio), push) for ratio, push in ((0.5, 22.4), (0.4, 14.5), (0.3, 6.7), (0.25, 2.7))],
)
def test_derated_ceilings_and_what_binds(upper: Any, push: float) -> None:
    reach = push_reach(TAROT_T960, WEIGHT, TIP, IDLE, upper)
    assert reach.push == pytest.approx(push, abs=0.06)
    assert np.isscalar(upper) or reach.binding == ((TAROT_T960.names.index("mid_right"), "upper"),)


def test_a_weak_outer_rotor_needs_a_push_to_hold_at_all() -> None:
    reach = push_reach(TAROT_T960, WEIGHT, TIP, IDLE, weak("front_left", 0.15))
    assert reach.least == pytest.approx(10.3, abs=0.06) and reach.push == pytest.approx(30.4, abs=0.05)


def test_a_dead_rotor_leaves_no_push() -> None:
    for dead in range(6):
        upper = UPPER.copy()
        upper[dead] = IDLE
        reach = push_reach(TAROT_T960, WEIGHT, TIP, IDLE, upper)
        # A lost outer rotor balances at the one push that unloads its partner as well, which is also the greatest.
        idle = np.full(6, IDLE)
        held = by_linear_program(SIX.matrix, hover_wrench(WEIGHT), push_direction(TIP), idle, upper, 1.0)
        assert reach.push == pytest.approx(held, abs=1e-6, nan_ok=True)
        if not math.isnan(reach.push):
            assert reach.least == pytest.approx(reach.push, abs=1e-6)
    octo = np.full(8, 35.0)
    octo[0] = 0.0
    assert push_reach(OCTOROTOR, WEIGHT, TIP, np.zeros(8), octo).push > 10.0


def test_tip_off_the_centre_plane_costs_reach() -> None:
    for height, push in ((0.05, 27.5), (0.10, 25.0), (0.20, 21.3)):
        reaches = [push_reach(TAROT_T960, WEIGHT, TIP + sign * height * DOWN, IDLE, FULL).push for sign in (-1.0, 1.0)]
        assert min(reaches) == pytest.approx(push, abs=0.06)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_equals_a_linear_program(data: st.DataObject) -> None:
    layout = data.draw(st.sampled_from(["six", "eight"]))
    facets, count = FACETS[layout], {"six": 6, "eight": 8}[layout]
    lower = np.array(data.draw(st.lists(st.sampled_from([0.0, 0.5, 1.2, 3.0]), min_size=count, max_size=count)))
    width = st.one_of(st.floats(1.0, 60.0), st.sampled_from([51.36, 51.36, 51.36, 0.0]))
    upper = lower + np.array(data.draw(st.lists(width, min_size=count, max_size=count)))
    tip = np.array([data.draw(st.floats(0.3, 1.0)), *data.draw(st.tuples(*[st.floats(-0.2, 0.2)] * 2))])
    travel = data.draw(st.one_of(st.none(), st.floats(0.0, 360.0).map(towards)))
    friction, weight = data.draw(st.floats(0.0, 1.0)), data.draw(st.floats(30.0, 80.0))
    direction, start = push_direction(tip, friction, travel), hover_wrench(weight)
    reach = push_reach(facets, weight, tip, lower, upper, friction=friction, travel=travel)
    wanted = [by_linear_program(facets.matrix, start, direction, lower, upper, sign) for sign in (1.0, -1.0)]
    if math.isnan(wanted[0]):
        # The program works to 1e-7: what it misses by less than that may count as held.
        relaxed = by_linear_program(facets.matrix, start, direction, lower - 1e-6, upper + 1e-6, 1.0)
        assert math.isnan(reach.push) or not math.isnan(relaxed)
    elif math.isnan(reach.push):
        # Held by less than the tolerance of the linear program: with limits 1e-6 N tighter it is not.
        tightened = by_linear_program(facets.matrix, start, direction, lower + 1e-6, upper - 1e-6, 1.0)
        assert math.isnan(tightened)
    else:
        assert reach.push == pytest.approx(wanted[0], abs=2e-5)
        assert reach.least == pytest.approx(wanted[1], abs=2e-5)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(4.0, 52.56), min_size=6, max_size=6), st.floats(0.0, 1.0), st.floats(0.0, 360.0))
def test_worst_travel_is_allowed_by_every_travel(upper: list[float], friction: float, angle: float) -> None:
    ceiling = np.array(upper)
    worst = worst_push_reach(SIX, WEIGHT, TIP, IDLE, ceiling, friction=friction)
    one = push_reach(SIX, WEIGHT, TIP, IDLE, ceiling, friction=friction, travel=towards(angle))
    if not math.isnan(worst.push):
        assert one.least - 1e-9 <= worst.least and worst.push <= one.push + 1e-9


def test_a_turned_wall_and_a_gust() -> None:
    """Any normal and any load: against the linear program, for a vehicle that is not square to its wall."""
    normal = np.array([math.cos(0.1), math.sin(0.1), 0.0])
    along = np.array([-normal[1], normal[0], 0.0])
    load = hover_wrench(WEIGHT) + np.array([2.0, -1.5, 1.0, 0.1, -0.2, 0.3])
    direction = push_direction(TIP, 0.3, along + 5.0 * normal, normal)
    np.testing.assert_allclose(direction[:3], normal + 0.3 * along, atol=1e-12)
    limits = np.full(6, IDLE), np.full(6, FULL)
    found = by_linear_program(SIX.matrix, load, direction, *limits, 1.0)
    assert SIX.interval(load, direction, *limits)[1] == pytest.approx(found, abs=1e-6)


def test_binding_rotors_are_at_their_limits() -> None:
    for facets, count in ((FACETS["six"], 6), (FACETS["eight"], 8)):
        lower, upper = np.full(count, IDLE), np.full(count, 30.0)
        reach = push_reach(facets, WEIGHT, TIP, lower, upper, friction=0.5, travel=RIGHT)
        direction = push_direction(TIP, 0.5, RIGHT)
        result = linprog(
            np.zeros(count),
            A_eq=facets.matrix,
            b_eq=hover_wrench(WEIGHT) + (reach.push - 1e-9) * direction,
            bounds=[*zip(lower, upper, strict=True)],
        )
        assert result.status == 0 and reach.binding
        for rotor, side in reach.binding:
            assert result.x[rotor] == pytest.approx(lower[rotor] if side == "lower" else upper[rotor], abs=1e-5)


def test_impossible_inputs_are_refused() -> None:
    with pytest.raises(ValueError, match="above the upper"):
        push_reach(TAROT_T960, WEIGHT, TIP, 10.0, 5.0)
    with pytest.raises(ValueError, match="span"):
        WrenchFacets(control_effectiveness(TAROT_T960)[:, :5])


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
def test_a_tilt_of_some_degrees_adds_newtons(friction: float, travel: Any, tilt_deg: float, push: float) -> None:
    tilt = math.radians(tilt_deg)
    found, angles = tilted_push_reach(SIX, *LIMITS, tilt=tilt, friction=friction, travel=travel)
    assert found == pytest.approx(push, abs=0.06)
    assert np.abs(angles).max() <= tilt + 1e-9


@pytest.mark.parametrize("layout", FACETS)
def test_without_tilt_it_is_the_reach_of_a_level_vehicle(layout: str) -> None:
    facets = FACETS[layout]
    for friction, travel in ((0.0, None), (0.5, RIGHT)):
        level = push_reach(facets, *LIMITS, friction=friction, travel=travel).push
        assert tilted_push_reach(facets, *LIMITS, tilt=0.0, friction=friction, travel=travel)[0] == pytest.approx(level)
    worst = worst_push_reach(facets, *LIMITS, friction=0.3).push
    assert worst <= worst_tilted_push_reach(facets, *LIMITS, tilt=0.0, friction=0.3) <= 1.02 * worst


def test_the_rotors_hold_the_push_at_that_attitude() -> None:
    """Gravity, push and friction in the axes of the tilted body: held up to the push found, and not beyond it.

    No other attitude within the limit holds 0.1 N more.
    """
    limit = math.radians(2.0)
    push, found = tilted_push_reach(SIX, *LIMITS, tilt=limit, friction=0.8, travel=-RIGHT)

    def held(force: float, angles: np.ndarray) -> bool:
        body = Rotation.from_euler("ZYX", (0.0, angles[1], angles[0])).inv()
        direction = body.apply((1.0, 0.0, 0.0) - 0.8 * RIGHT)
        wrench = force * np.concatenate((direction, np.cross(TIP, direction)))
        wrench[:3] -= body.apply((0.0, 0.0, WEIGHT))
        return SIX.contains(wrench, IDLE, FULL)

    assert held(0.9999 * push, found) and not held(1.0001 * push, found)
    grid = np.linspace(-limit, limit, 21)
    assert not any([held(push + 0.1, np.array((roll, pitch))) for roll in grid for pitch in grid])


def test_no_push_is_possible_without_a_hover() -> None:
    found, angles = tilted_push_reach(SIX, WEIGHT, TIP, IDLE, 3.0, tilt=0.1)
    assert math.isnan(found) and np.isnan(angles).all()
    assert math.isnan(worst_tilted_push_reach(SIX, WEIGHT, TIP, IDLE, 3.0, tilt=0.1, friction=0.3))
