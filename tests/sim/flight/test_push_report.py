"""Push asked, commanded and flown by a light vehicle: reasons of a reduction, and the push once friction is known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import ibvs_qp
from allocation import TAROT_T960, push_reach
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from ibvs_qp.pilot import PilotConfig
from sim.experiments.scenes import near_wall
from sim.flight.closed_loop import fly
from sim.flight.jobs import PressJob
from sim.flight.options import FlightOptions
from sim.flight.trace import Trace

#: A hexarotor of 3.4 kg with little tilt: it pushes 9.7 N standing still, 5.0 N sliding at friction 0.3, 2.8 N at 0.8.
LIGHT = VehicleParams(
    geometry=dataclasses.replace(TAROT_T960, circle_radius_m=0.35, tilt_deg=20.0),
    mass_kg=3.4,
    inertia_kg_m2=(0.066, 0.09, 0.145),
    thrust_max_n=25.0,
    propeller_radius_m=0.127,
    tip_position_m=(0.55, 0.0, 0.0),
    force_torque_position_m=(0.2, 0.0, 0.0),
    tool_mass_kg=0.25,
    tool_position_m=(0.38, 0.0, 0.0),
    camera_position_m=(0.1, 0.0, 0.07),
)
#: Way of the tip within which friction is learnt [m].
LEARNT_M = 0.2


def slide_reach(vehicle: VehicleParams, friction: float) -> float:
    """Greatest push while the tip slides to the left [N]."""
    limits = vehicle.thrust_min, vehicle.thrust_max
    tip, left = np.array(vehicle.tip_position_m), np.array([0.0, -1.0, 0.0])
    weight = vehicle.mass_kg * GRAVITY
    return push_reach(vehicle.geometry, weight, tip, *limits, friction=friction, travel=left).push


def slide(push: float, config: PilotConfig | None = None, speed: float = 0.1, law: str = "qp") -> Trace:
    """Press for a second, then slide to the left for 0.5 m at friction 0.3."""
    scene = near_wall(paint={"push_n": push, "speed_m_s": speed}, wall={"friction": 0.3})
    options = FlightOptions(law=law, features="geometric", video=False)
    return fly(scene, options, config=config, job=PressJob(hold_s=2.0, slide_s=0.5 / speed + 1.0))


def flown(trace: Trace) -> tuple[float, float]:
    """Mean push over the first centimetres of the slide, and after `LEARNT_M` [N]."""
    sliding = trace.phase == trace.phases.index("paint")
    way = np.abs(trace.tip[:, 1] - trace.tip[np.flatnonzero(sliding)[0], 1])
    begin, later = trace.push_true[sliding & (way < 0.02)], trace.push_true[sliding & (way > LEARNT_M)]
    return float(begin.mean()), float(later.mean())


def light(assumed: float = 0.8) -> PilotConfig:
    config = ibvs_qp.preset("qp")
    contact = dataclasses.replace(config.controller.contact, assumed_friction=assumed)
    return dataclasses.replace(
        config, controller=dataclasses.replace(config.controller, vehicle=LIGHT, contact=contact)
    )


@pytest.mark.slow
def test_the_push_recovers_once_friction_is_measured_and_every_reason_is_named_once() -> None:
    trace = slide(10.0, light())
    begin, later = flown(trace)
    print(f"10 N asked: {begin:.2f} N at first, {later:.2f} N after {LEARNT_M} m, of {slide_reach(LIGHT, 0.3):.2f} N")
    assert begin < slide_reach(LIGHT, 0.8)
    assert 0.9 * slide_reach(LIGHT, 0.3) <= later <= slide_reach(LIGHT, 0.3)
    reasons = [event.text for event in trace.events if event.kind == "push reduced"]
    assert len(reasons) == 2
    assert reasons[0].startswith("reach 2.") and "N of 10.0 N asked: friction 0.80 assumed, " in reasons[0]
    assert reasons[1].startswith("reach 4.") and "N of 10.0 N asked: friction 0.3" in reasons[1]
    assert "measured, front_right at its lower limit of 1.2 N" in reasons[1]


@pytest.mark.slow
def test_a_lower_assumed_friction_presses_harder_from_the_start() -> None:
    begin, later = flown(slide(4.0, light(assumed=0.3)))
    print(f"4 N asked, friction 0.3 assumed: {begin:.2f} N at first, {later:.2f} N later")
    assert begin == pytest.approx(4.0, rel=0.1) and later == pytest.approx(4.0, rel=0.05)


@pytest.mark.slow
def test_a_push_within_reach_is_restored_with_an_event() -> None:
    trace = slide(4.0, light())
    begin, later = flown(trace)
    kinds = [event.kind for event in trace.events if event.kind.startswith("push ")]
    print(f"4 N asked: {begin:.2f} N at first, {later:.2f} N later, {kinds}")
    assert begin < 3.2 and later == pytest.approx(4.0, rel=0.05)
    assert kinds == ["push reduced", "push restored"]


@pytest.mark.slow
@pytest.mark.parametrize("law", ["qp", "paper"])
def test_the_default_job_flies_its_push(law: str) -> None:
    trace = slide(5.0, law=law)
    _, later = flown(trace)
    assert later >= 0.95 * 5.0
    assert not [event for event in trace.events if event.kind.startswith("push ")]


@pytest.mark.slow
def test_friction_is_measured_at_a_creeping_speed_too() -> None:
    _, later = flown(slide(4.0, light(), speed=0.02))
    assert later == pytest.approx(4.0, rel=0.05)
