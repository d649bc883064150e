"""Computations of notebook 04: cuts of the wrench set, abilities, rotor loss, and the choice of a design."""

import math

import numpy as np
import polars as pl
import pytest

from allocation import WrenchFacets
from sim.notebook.vehicle import DOWN, FRONT, YAW, Duties, abilities, after_loss, cheapest, design_map, vehicle_case

WEAK = vehicle_case(weak_rotor="rear_left", fraction=0.5)


@pytest.mark.parametrize("case", [vehicle_case(), vehicle_case(mass_kg=7.5, tilt_deg=22.0), WEAK])
def test_cuts_end_where_the_set_ends(case):
    facets = WrenchFacets(case.geometry)

    def attainable(wrench: list[float]) -> bool:
        low, high = facets.rooms(np.array(wrench), case.lower, case.upper)
        return bool((low <= 0.0).all() and (high >= 0.0).all())

    side, level = case.cut(np.zeros(6), FRONT, -DOWN), case.level_cut()
    for corners, wrench in (
        (side, lambda front, up: [front, 0.0, -up, 0.0, 0.0, 0.0]),
        (level, lambda right, front: [front, right, -case.weight_n, 0.0, 0.0, 0.0]),
    ):
        middle = corners.mean(axis=0)
        for corner in corners:
            assert attainable(wrench(*(middle + 0.999 * (corner - middle))))
            assert not attainable(wrench(*(middle + 1.001 * (corner - middle))))
    push = case.cut(-case.weight_n * DOWN, FRONT, YAW)[:, 0].max()
    assert push == pytest.approx(case.reach().push, abs=1e-6)
    assert np.linalg.norm(level, axis=1).min() >= case.level_force_n - 1e-6


def test_level_hover_is_impossible_without_a_rotor():
    lost = vehicle_case(weak_rotor="mid_right", fraction=0.0)
    assert lost.level_cut().shape == (0, 2) and math.isnan(lost.reach().push)
    force, lean, yaw = after_loss(vehicle_case(weak_rotor="mid_right", fraction=0.0, thrust_min_n=0.0))
    # Published for this geometry: 0.289 m g, 16.1 deg, or 17 N m of yaw moment.
    assert force == pytest.approx(0.289 * lost.weight_n, rel=2e-3)
    assert lean == pytest.approx(16.1, abs=0.05) and yaw == pytest.approx(17.5, abs=0.05)
    assert np.isnan(after_loss(lost)).all()


def test_weak_rotors_bound_the_push_from_above_or_below():
    mid = [vehicle_case(weak_rotor="mid_right", fraction=each).reach().push for each in (0.5, 0.4, 0.3, 0.25, 0.2)]
    assert mid[:4] == pytest.approx([22.4, 14.5, 6.7, 2.7], abs=0.05) and math.isnan(mid[4])
    outer = vehicle_case(weak_rotor="front_left", fraction=0.15).reach()
    assert (outer.least, outer.push) == pytest.approx((10.3, 30.4), abs=0.05)


def test_a_push_within_reach_satisfies_the_limits_of_every_rotor():
    case = vehicle_case(mass_kg=5.0, tilt_deg=35.0)
    for push, inside in ((0.99 * case.reach().push, True), (1.01 * case.reach().push, False)):
        thrusts = case.push_thrusts(push)
        assert bool(((thrusts >= case.lower) & (thrusts <= case.upper)).all()) is inside


def test_the_cheapest_design_meets_every_duty_and_no_cheaper_one_does():
    duties = Duties(push_n=15.0, sliding_push_n=8.0, friction=0.5, gust_n=9.0, least_mass_kg=5.0)
    designs = design_map(duties, np.arange(15.0, 41.0, 1.0), np.arange(4.0, 8.1, 0.5))
    chosen = cheapest(designs)
    assert chosen is not None
    figures = abilities(chosen, duties.friction)
    assert figures["greatest push, standing still [N]"] >= 15.0 and figures["greatest push, any travel [N]"] >= 8.0
    assert chosen.level_force_n >= 9.0
    cheaper = designs.filter(pl.col("power_w") < chosen.hover_power_w - 1e-9)
    assert cheaper.height > 0 and (cheaper["margin"] < 0.0).all()
    assert cheapest(design_map(Duties(push_n=1e3), np.array([30.0]), np.array([6.0]))) is None
