"""What notebook 04 computes: cuts of the wrench set, abilities, rotor loss, and the choice of a design."""

import math

import numpy as np
import pytest

from allocation import level_polygon
from sim.notebook.ability.abilities import abilities, kept_after_loss, push_over_share, push_thrusts
from sim.notebook.ability.case import vehicle_case
from sim.notebook.ability.choice import Duties, design_map
from sim.notebook.ability.cuts import level_cut, side_cut, yaw_cut
from sim.notebook.ability.words import abilities_table, choice_text


@pytest.mark.parametrize("case", [vehicle_case(), vehicle_case(mass_kg=7.5, tilt_deg=22.0)])
def test_level_cut_is_the_level_polygon(case):
    corners = level_cut(case)
    wanted = level_polygon(case.facets, case.weight_n, case.lower, case.upper)
    assert sorted(map(tuple, corners.round(5))) == sorted(map(tuple, (wanted + 0.0).round(5)))


def test_cuts_end_where_the_set_ends():
    case = vehicle_case(weak_rotor="rear_left", share=0.5)
    limits = case.lower, case.upper
    corners = side_cut(case)
    middle = corners.mean(axis=0)
    for corner in corners:
        (front, up), (far_front, far_up) = middle + 0.999 * (corner - middle), middle + 1.001 * (corner - middle)
        assert case.facets.contains(np.array([front, 0.0, -up, 0.0, 0.0, 0.0]), *limits)
        assert not case.facets.contains(np.array([far_front, 0.0, -far_up, 0.0, 0.0, 0.0]), *limits)
    assert yaw_cut(case)[:, 0].max() == pytest.approx(abilities(case, 0.0).push_still_n, abs=1e-6)


def test_nothing_is_attainable_level_without_a_rotor():
    lost = vehicle_case(weak_rotor="mid_right", share=0.0)
    assert level_cut(lost).shape == (0, 2) and math.isnan(abilities(lost, 0.3).push_still_n)
    kept = kept_after_loss(lost.without_idle_floor())
    # Published for this geometry: 0.289 m g, 16.1 deg, or 17 N m of yaw moment.
    assert kept["lateral_n"] == pytest.approx(0.289 * lost.weight_n, rel=2e-3)
    assert kept["lean_deg"] == pytest.approx(16.1, abs=0.05) and kept["yaw_nm"] == pytest.approx(17.5, abs=0.05)
    assert all(math.isnan(value) for value in kept_after_loss(lost).values())


def test_weak_rotors_bound_the_push_from_above_or_below():
    mid = push_over_share("mid_right", np.array([0.5, 0.4, 0.3, 0.25, 0.2]), 6.0, 30.0)
    assert mid[:4, 1] == pytest.approx([22.4, 14.5, 6.7, 2.7], abs=0.05) and np.isnan(mid[4]).all()
    outer = push_over_share("front_left", np.array([0.15]), 6.0, 30.0)[0]
    assert outer == pytest.approx([10.3, 30.4], abs=0.05)


def test_a_push_within_reach_keeps_every_rotor_within_its_limits():
    case = vehicle_case(mass_kg=5.0, tilt_deg=35.0)
    reach = abilities(case, 0.0).push_still_n
    for push, inside in ((0.99 * reach, True), (1.01 * reach, False)):
        thrusts = push_thrusts(case, push)
        assert bool(((thrusts >= case.lower) & (thrusts <= case.upper)).all()) is inside


def test_the_cheapest_design_meets_every_duty_and_no_cheaper_one_does():
    duties = Duties(push_n=15.0, sliding_push_n=8.0, friction=0.5, gust_n=9.0, least_mass_kg=5.0)
    designs = design_map(duties, np.arange(15.0, 41.0, 1.0), np.arange(4.0, 8.1, 0.5))
    chosen = designs.cheapest(duties)
    assert chosen is not None
    figures = abilities(chosen, duties.friction)
    assert figures.push_still_n >= 15.0 and figures.push_any_n >= 8.0 and figures.lateral_worst_n >= 9.0
    cheaper = designs.power_w < chosen.hover_power_w
    assert cheaper.any() and (designs.spare(duties)[cheaper] < 0.0).all()
    assert "Cheapest" in choice_text(chosen, vehicle_case(), duties)
    assert designs.cheapest(Duties(push_n=1e3)) is None


def test_the_table_says_impossible_instead_of_nan():
    lost = abilities(vehicle_case(weak_rotor="mid_left", share=0.1), 0.3)
    assert "impossible" in abilities_table(lost, abilities(vehicle_case(), 0.3)) and "nan" not in abilities_table(
        lost, lost
    )
