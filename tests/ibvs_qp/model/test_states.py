"""Anti-windup under both laws: a demand that the rotors could not serve is not remembered.

Integrators of a tick, and what keeps each from winding up:

=====================  ==============================================================================================
state                  guard
=====================  ==============================================================================================
force_integral         rests while more than 0.5 N or N m is given up; bounded by 8 N; zero without contact
search_force           rests likewise; bounded by 6 N; zero away from the wall
line_k_integral        rests likewise and while friction holds the tip; bounded by 0.6 1/s^2; zero in a new line's slot
velocity_integral_k    rests likewise; bounded by 0.8 m/s^2; fades where a line takes the direction over
external_force,        know the thrusts that were commanded, not those that were wished: nothing given up enters them
external_moment
push_kalman.state      knows the thrusts that were commanded; its forces are bounded by 40 N and 6 N; anew
                       with each contact
friction               rises while a tip that shall travel is held, given up or not: it lowers the push, which frees the
                       tip; bounded by 1.2, and sliding corrects it within half a second
=====================  ==============================================================================================
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np
import pytest
from controller_scenes import line_references
from small_vehicle import SmallVehicle

from ibvs_qp.analytic import PaperController
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference
from ibvs_qp.symbolic.function import StepFunction
from ibvs_qp.symbolic.signals import Signals

LAWS = [HybridController, PaperController]
#: The states above that a demand could wind up.
INTEGRALS = ("force_integral", "search_force", "line_0_integral", "line_1_integral")
INTEGRALS += ("velocity_integral_0", "velocity_integral_1")
#: How long the rotors are too weak: 3 s [ticks], and until a free vehicle or a press has settled.
SATURATED, SETTLE, PRESSED = 750, 300, 800
#: Rotors that just carry the weight [N]: nothing is left for anything else.
WEAK = np.full(6, 11.4)
FREE = Reference(standoff=0.1, lines=line_references(1))
PRESS = Reference(push_force=5.0, standoff=0.02, contact=True, lines=line_references(1))


def integrating(**switches: bool) -> ControllerConfig:
    """A controller that integrates the error of the push; the shipped ones need not."""
    config = ControllerConfig(**switches)
    return replace(config, gains=replace(config.gains, force_kfi=1.4))


@dataclass
class Loop:
    """A small vehicle under a law."""

    controller: HybridController | PaperController
    distance: float
    count: int = 1
    vehicle: SmallVehicle = field(init=False)

    def __post_init__(self) -> None:
        self.vehicle = SmallVehicle(self.controller.config, distance=self.distance)

    def fly(self, ticks: int, reference: Reference, most: np.ndarray | None = None) -> np.ndarray:
        """Push [N], place right and down [m] and what was given up [N, N m], a row for every tick."""
        limits, rows = {} if most is None else {"thrust_max": most}, []
        for _ in range(ticks):
            command = self.controller.step(self.vehicle.measure(self.count, **limits), reference)
            self.vehicle.fly(command.thrusts)
            lost = float(np.abs(command.unallocated_wrench).max())
            rows.append([-self.vehicle.contact[0], *self.vehicle.position[1:], lost])
        return np.array(rows)

    @property
    def held(self) -> np.ndarray:
        """What the integrators hold."""
        return np.array([self.controller.setpoints.step.states[name][0] for name in INTEGRALS])

    def state(self, name: str) -> np.ndarray:
        return self.controller.setpoints.step.states[name]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("distance", [0.005, -0.002])  # before the touch, and in contact
def test_every_integrator_rests_while_limits_take_what_it_asks_for(law: type, distance: float) -> None:
    """Rotors so weak that no tick goes as wanted, errors everywhere: what the integrators hold stays as it is."""
    loop = Loop(law(integrating()), distance=0.005, count=2)
    press = replace(PRESS, lines=line_references(2))
    for _ in range(900):
        loop.fly(1, press)
        if loop.vehicle.distance < distance:
            break
    off = tuple(replace(line, rho=line.rho + 0.05) for line in press.lines)
    wanted, held = replace(press, push_force=8.0, velocity=np.array([0.2, 0.2]), lines=off), None
    for tick in range(200):  # the vehicle stays where it is
        measurement = loop.vehicle.measure(2, thrust_max=np.full(6, 10.5))
        command = loop.controller.step(measurement, wanted)
        loop.vehicle.tick += 1
        if tick > 50:
            assert np.abs(command.unallocated_wrench).max() > 0.5
            held = loop.held if held is None else held
            np.testing.assert_array_equal(loop.held[1:], held[1:])
            assert abs(loop.held[0]) <= abs(held[0])  # the force's may fall, so that it never keeps the limit active
    assert held is not None and np.any(held != 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_a_speed_out_of_reach_is_forgotten_with_the_wish(law: type) -> None:
    """Half a metre a second asked of rotors that cannot: released, the vehicle stops instead of making up for it."""
    loop = Loop(law(), distance=0.1)
    loop.fly(SETTLE, FREE)
    weak = loop.fly(SATURATED, replace(FREE, velocity=np.array([0.5, 0.0])), WEAK)
    assert np.median(weak[:, 3]) > 0.5
    assert abs(loop.state("velocity_integral_0")[0]) < 0.01  # its bound is 0.25 m
    assert np.linalg.norm(loop.state("external_force")) < 0.5  # N: what was not commanded is no load
    if law is HybridController:  # the analytic law, clipped, has climbed by 0.7 m and lost its line
        after = loop.fly(SATURATED, FREE)
        assert abs(loop.vehicle.velocity[1]) < 0.03
        assert after[:, 1].max() - weak[-1, 1] < 0.05


@pytest.mark.slow
def test_lines_out_of_reach_are_come_back_to_without_overshoot() -> None:
    loop, two = Loop(HybridController(), distance=0.1, count=2), replace(FREE, lines=line_references(2))
    home = loop.fly(SETTLE, two)[-1, 1]
    before = loop.held
    off = tuple(replace(line, rho=line.rho + 0.1) for line in two.lines)
    weak = loop.fly(SATURATED, replace(two, lines=off), WEAK)
    assert np.median(weak[:, 3]) > 0.5 and weak[-1, 1] - home > 0.02
    np.testing.assert_allclose(loop.held, before, atol=2e-3)
    after = loop.fly(SATURATED, two)
    assert home - after[:, 1].min() < 0.002


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_a_push_out_of_reach_leaves_no_debt(law: type) -> None:
    """Asked for 40 N of 30.4 N without the reach check: what is missing is not collected afterwards."""
    loop = Loop(law(ControllerConfig(reach_check=False)), distance=0.005)
    loop.fly(PRESSED, PRESS)
    loop.fly(SATURATED, replace(PRESS, push_force=29.0))
    loop.fly(250, replace(PRESS, push_force=40.0))  # the push asked for rises by 10 N/s
    held = loop.held
    ticks = SATURATED - 250 if law is HybridController else 200  # clipped, the vehicle climbs and comes back
    weak = loop.fly(ticks, replace(PRESS, push_force=40.0))
    assert weak[:, 3].min() > 0.5
    np.testing.assert_array_equal(loop.held, held)
    if law is HybridController:  # the analytic law, clipped, has left the line by 0.1 m and bounces off
        after = loop.fly(SATURATED, PRESS)
        assert after[:, 0].min() > 2.5 and abs(after[-25:, 0].mean() - 5.0) < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_the_lag_of_a_ramp_fills_no_integral(law: type) -> None:
    """A push of 25 N overshoots little, although motors and filter are late."""
    loop = Loop(law(), distance=0.005)
    push = loop.fly(PRESSED + SETTLE, replace(PRESS, push_force=25.0))[:, 0]
    assert push.max() < 1.12 * 25.0 and abs(push[-100:].mean() - 25.0) < 0.3


@pytest.mark.slow
def test_an_integral_that_alone_keeps_the_thrusts_limited_falls(monkeypatch: pytest.MonkeyPatch) -> None:
    """28 N of 30.4 N and 5 N of integral too much, as a touch may leave them: limited, it must fall."""
    loop = Loop(HybridController(integrating(reach_check=False)), distance=0.005)
    press, step = replace(PRESS, push_force=28.0), loop.controller.setpoints.step
    loop.fly(PRESSED, press)
    advance = step.advance

    def wind_up() -> None:
        advance()
        step.states["force_integral"][:] += 5.0 / loop.controller.config.gains.force_kfi

    with monkeypatch.context() as patched:
        patched.setattr(step, "advance", wind_up)
        assert loop.fly(10, press)[-1, 3] > 0.5  # the row's filter lets it through within some ticks
    assert abs(loop.fly(2 * SATURATED, press)[-50:, 0].mean() - 28.0) < 0.3


@pytest.mark.parametrize("odd", [math.nan, math.inf, -math.inf])
def test_states_stay_where_one_of_them_would_not_be_finite(odd: float) -> None:
    signals = Signals()
    total, count = signals.state("total"), signals.state("count")
    signals.remember("total", total + signals.input("more"))
    signals.remember("count", count + 1.0)
    signals.output("shown", ca.sin(total))
    step = StepFunction(signals)
    for more in (2.0, odd, 3.0):
        step.inputs["more"][0] = more
        step.evaluate()
        step.advance()
    assert step.states["total"].item() == 5.0 and step.states["count"].item() == 2.0
    step.reset()
    assert step.states["total"].item() == step.states["count"].item() == 0.0
