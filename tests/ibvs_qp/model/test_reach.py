"""Reach as a controller knows it in flight: against the linear program, and what a command says of it."""

from __future__ import annotations

import dataclasses
import functools
import math
import re

import casadi as ca
import numpy as np
import pytest
from controller_scenes import measured
from hypothesis import given, settings
from hypothesis import strategies as st
from reach_oracle import DOWN, OCTOROTOR, RIGHT, TIP, WEIGHT, by_linear_program

from allocation import TAROT_T960, control_effectiveness, hover_wrench, push_direction, push_reach
from ibvs_qp.analytic import PaperController
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.reach import push_planes
from ibvs_qp.model.reach import push_reach as live_push_reach
from ibvs_qp.symbolic.signals import Signals

#: Into a wall straight ahead.
FRONT = np.array([1.0, 0.0, 0.0])
LAYOUTS = {"six": TAROT_T960, "eight": OCTOROTOR}
#: Full thrust of the weakened front-left rotor [N]: 15 % of what it has.
WEAK = 0.15 * 52.56


@functools.cache
def live(layout: str) -> ca.Function:
    """The block of the tick as a function of limits, normal, travel, friction and static wrench."""
    signals, count = Signals(), LAYOUTS[layout].count
    normal, travel = ca.SX.sym("normal", 3), ca.SX.sym("travel", 3)
    friction, static = ca.SX.sym("friction"), ca.SX.sym("static", 6)
    vehicle = VehicleParams(geometry=LAYOUTS[layout])
    live_push_reach(signals, push_planes(signals, vehicle, normal, travel, friction, static))
    low, high = signals.input("thrust_low", count), signals.input("thrust_high", count)
    return ca.Function(
        "live", [low, high, normal, travel, friction, static], [signals.outputs["least_push"], signals.outputs["reach"]]
    )


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_live_reach_equals_the_linear_program(data: st.DataObject) -> None:
    layout = data.draw(st.sampled_from(["six", "eight"]))
    count = LAYOUTS[layout].count
    lower = np.array(data.draw(st.lists(st.sampled_from([0.0, 0.5, 1.2, 3.0]), min_size=count, max_size=count)))
    width = st.one_of(st.floats(1.0, 60.0), st.sampled_from([51.36, 51.36, 51.36, 0.0]))
    upper = lower + np.array(data.draw(st.lists(width, min_size=count, max_size=count)))
    angle, turn = data.draw(st.floats(0.0, 2.0 * math.pi)), data.draw(st.floats(-0.2, 0.2))
    normal = np.array([math.cos(turn), math.sin(turn), 0.0])
    along = np.array([-math.sin(turn), math.cos(turn), 0.0])
    travel = data.draw(st.sampled_from([0.0, 0.05])) * (math.cos(angle) * along + math.sin(angle) * DOWN)
    friction, load = data.draw(st.floats(0.0, 1.0)), np.array(data.draw(st.tuples(*[st.floats(-2.0, 2.0)] * 3)))
    held = hover_wrench(data.draw(st.floats(30.0, 80.0))) + np.concatenate((load, 0.1 * load))
    least, reach = (float(entry) for entry in live(layout)(lower, upper, normal, travel, friction, -held))
    direction = push_direction(TIP, friction, travel, normal)
    matrix = control_effectiveness(LAYOUTS[layout])
    wanted = [by_linear_program(matrix, held, direction, lower, upper, sign) for sign in (1.0, -1.0)]
    if math.isnan(wanted[0]):
        # The program works to 1e-7: what it misses by less than that may count as held.
        relaxed = by_linear_program(matrix, held, direction, lower - 1e-6, upper + 1e-6, 1.0)
        assert least > reach or not math.isnan(relaxed)
    else:
        assert reach == pytest.approx(wanted[0], abs=2e-5)
        assert least == pytest.approx(wanted[1], abs=2e-5)


@pytest.mark.parametrize("rotor", range(6))
def test_planes_that_the_push_moves_along_shut_it_out_as_well(rotor: int) -> None:
    """Friction chosen so that a rotor does not mind the push: where it is too weak to hover, no push helps."""
    facet = np.linalg.inv(control_effectiveness(TAROT_T960))[rotor]
    still = facet @ push_direction(TIP)
    across = facet @ (push_direction(TIP, 1.0, RIGHT) - push_direction(TIP))
    travel, friction = -np.sign(still * across) * RIGHT, abs(still / across)
    assert abs(facet @ push_direction(TIP, friction, travel)) < 1e-12
    for ceiling, holds in ((52.56, True), (5.0, False)):
        upper = np.full(6, 52.56)
        upper[rotor] = ceiling
        lower, load = np.full(6, 1.2), -hover_wrench(WEIGHT)
        least, reach = (float(entry) for entry in live("six")(lower, upper, FRONT, travel, friction, load))
        found = push_reach(TAROT_T960, WEIGHT, TIP, lower, upper, friction=friction, travel=travel)
        assert (least <= reach) is holds and math.isnan(found.push) is not holds
        if holds:
            assert (least, reach) == pytest.approx((found.least, found.push), abs=1e-6)


def commanded(push: float, upper: np.ndarray, law: type = HybridController) -> tuple[str, float, float]:
    """What one tick before the wall says with weakened rotors: notes, margin, the least push of the allocation."""
    controller = law(ControllerConfig())
    measurement: Measurement = dataclasses.replace(
        measured(0), thrust_max=upper, plane=(0.0, 0.0, 1.0 / 0.6, -1.0), plane_stamp_ns=4_000_000
    )
    command = controller.step(measurement, Reference(contact=True, push_force=push))
    return "; ".join(command.rejected), command.reach_margin, push_reach(TAROT_T960, WEIGHT, TIP, 1.2, upper).least


@pytest.mark.parametrize("law", [HybridController, PaperController])
def test_a_push_below_the_least_is_named(law: type) -> None:
    full = np.full(6, 52.56)
    weak = np.where(np.array(TAROT_T960.names) == "front_left", WEAK, full)
    said, margin, least = commanded(5.0, weak, law)
    assert least == pytest.approx(10.3, abs=0.05)
    assert "reference.push_force: 5.0 N" in said and f"least push of the rotors, {least:.1f} N" in said
    assert math.isfinite(margin)
    assert commanded(15.0, weak, law)[0] == "" and commanded(5.0, full, law)[0] == ""


def test_no_push_at_all_is_named_and_has_no_margin() -> None:
    said, margin, least = commanded(5.0, np.full(6, 8.0))
    assert math.isnan(least) and math.isnan(margin)
    assert "cannot hold any push" in said


def test_a_small_reduction_is_shown() -> None:
    """Not "5.0 N reduced to 5.0 N"."""
    full = np.full(6, 52.56)
    reach = commanded(0.0, full)[1]
    said = commanded(0.97 * reach + 0.01, full)[0]
    before, after = (float(number) for number in re.findall(r"([\d.]+) N", said))
    assert before - after == pytest.approx(0.01, abs=2e-3), said
