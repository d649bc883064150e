"""Switches of phase, lines, limits and reach: thrusts bend, they do not jump."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from closed_loop_rigs import short_scene
from controller_scenes import line_references
from small_vehicle import SmallVehicle

from ibvs_qp.analytic import PaperController
from ibvs_qp.command import Outcome
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference
from sim.faults.rotors import Derate
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions

LAWS = [HybridController, PaperController]
#: Largest thrust step that the vehicle's rate limit allows in a tick [N]: 500 N/s.
RATE_STEP = 500.0 * 0.004
#: Until the press has settled, how long a switch lasts, and the time to settle again [ticks].
SETTLE, SWITCHED, REST = 900, 100, 150
PRESS = Reference(push_force=5.0, standoff=0.02, contact=True, lines=line_references(1))
WEAK_ROTOR = np.array([52.56, 52.56, 9.0, 52.56, 52.56, 52.56])

#: Name of a switch, what it changes of measurement and reference, and the largest thrust step it may make [N]. Where a
#: limit falls below the thrust, or the vehicle is told to let go, the thrusts follow as fast as they may.
SWITCHES: list[tuple[str, dict[str, Any], dict[str, Any], float]] = [
    ("a line appears", {"count": 2}, {"lines": line_references(2)}, 0.3),
    ("the line disappears", {"count": 0}, {}, 0.1),
    ("its reference goes too", {"count": 0}, {"lines": ()}, 0.2),
    ("more push than there is", {}, {"push_force": 40.0}, 0.4),
    ("the velocity is lost", {"velocity": None}, {}, 0.3),
    ("the force sensor is lost", {"contact_wrench": np.full(6, np.nan)}, {}, 0.1),
    ("the plane is lost", {"plane": None}, {}, 0.2),
    ("hold to slide", {}, {"velocity": np.array([-0.05, 0.0]), "travel": np.array([-0.05, 0.0])}, 0.6),
    ("all rotors derated", {"thrust_max": np.full(6, 16.0)}, {}, RATE_STEP),
    ("one rotor derated", {"thrust_max": WEAK_ROTOR}, {}, RATE_STEP),
    ("press to stand-off", {}, {"contact": False}, RATE_STEP),
]


@pytest.fixture(scope="module", params=LAWS)
def steps(request: pytest.FixtureRequest) -> dict[str, float]:
    """Largest thrust step [N] while each switch is on and after it is off again, one after the other in one flight."""
    controller, last, found = request.param(), None, {}
    vehicle = SmallVehicle(controller.config, distance=0.005)

    def fly(ticks: int, measured: dict[str, Any], wanted: dict[str, Any]) -> float:
        nonlocal last
        largest = 0.0
        for _ in range(ticks):
            command = controller.step(vehicle.measure(**({"count": 1} | measured)), replace(PRESS, **wanted))
            vehicle.fly(command.thrusts)
            assert command.outcome is Outcome.SOLVED
            largest = max(largest, 0.0 if last is None else float(np.abs(command.thrusts - last).max()))
            last = command.thrusts
        return largest

    found["settle"] = fly(SETTLE, {}, {})
    for name, measured, wanted, _ in SWITCHES:
        assert -vehicle.contact[0] == pytest.approx(5.0, abs=0.6), f"no press before: {name}"
        found[name] = max(fly(SWITCHED, measured, wanted), fly(REST, {}, {}))
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("switch", "bound"), [(name, bound) for name, _, _, bound in SWITCHES])
def test_no_switch_makes_the_thrusts_jump(steps: dict[str, float], switch: str, bound: float) -> None:
    assert steps["settle"] <= RATE_STEP + 1e-9
    assert steps[switch] <= bound + 1e-9


#: Largest thrust step within 0.2 s of entering a phase [N]; starting to move and letting go may use the whole rate.
#: Noise alone makes steps of up to 0.4 N in hover.
PHASES = {"approach": RATE_STEP, "align": 0.6, "press": 1.5, "paint": 0.6, "retreat": RATE_STEP, "done": 0.5}


@pytest.mark.slow
@pytest.mark.parametrize("law", ["qp", "paper"])
def test_no_phase_and_no_fault_of_a_whole_flight_makes_the_thrusts_jump(law: str) -> None:
    """Free flight, approach, contact, slide with a rotor that weakens on the way, and off the wall again."""
    fault = Derate(after="paint", delay_s=1.0, rotor="front_left", share=0.25)
    options = FlightOptions(law=law, features="geometric", video=False)
    trace = fly(short_scene(0.25, rows=1), options, faults=(fault,))
    assert [event.kind for event in trace.events].count("fault") == 1 and trace.claimed
    steps = np.abs(np.diff(trace.thrusts, axis=0)).max(axis=1)
    assert steps[1:].max() <= RATE_STEP + 1e-6  # the first command comes from nowhere
    for tick in np.flatnonzero(np.diff(trace.phase)):
        name = trace.phases[int(trace.phase[tick + 1])]
        assert steps[tick : tick + 50].max() <= PHASES[name] + 1e-6, name
    struck = next(event.t for event in trace.events if event.kind == "fault")
    after = (trace.t[1:] > struck) & (trace.t[1:] < struck + 0.2)
    assert steps[after].max() <= 0.6  # the press needs less than what is left of that rotor
