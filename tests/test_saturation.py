"""Static push at and beyond what the rotors can hold: who pays, and what the commands say."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from closed_loop_rigs import wall

from sim.closed_loop import FlightOptions, fly, pilot_config
from sim.jobs import PressJob
from sim.scene import Scene
from sim.trace import Trace

#: Push that the nominal vehicle can hold standing still [N].
REACH_N = 30.4


def press(push: float, friction: float, reach_check: bool, law: str = "qp") -> Trace:
    scene = Scene(wall=wall(friction=friction))
    scene = dataclasses.replace(scene, paint=dataclasses.replace(scene.paint, push_n=push))
    options = FlightOptions(law=law, features="geometric", video=False)
    config = pilot_config(scene, options)
    config = dataclasses.replace(config, controller=dataclasses.replace(config.controller, reach_check=reach_check))
    return fly(scene, options, config=config, job=PressJob(hold_s=8.0))


def settled(trace: Trace) -> np.ndarray:
    """The hold after the first three seconds of full weight: ticks."""
    holding = np.flatnonzero((trace.contact_weight > 0.99) & (trace.phase == trace.phases.index("press")))
    return holding[trace.t[holding] > trace.t[holding[0]] + 3.0]


@pytest.mark.parametrize(("push", "friction"), [(15.0, 0.3), (25.0, 0.05), (30.0, 0.3), (30.0, 0.05)])
def test_a_static_push_within_reach_is_delivered(push: float, friction: float) -> None:
    trace = press(push, friction, reach_check=True)
    ticks = settled(trace)
    delivered = float(trace.push_true[ticks].mean())
    print(f"{push:g} N at mu {friction:g}: {delivered:.2f} N")
    assert trace.completed and delivered == pytest.approx(push, rel=0.05)


@pytest.mark.parametrize("reach_check", [True, False])
def test_a_push_beyond_reach_is_given_up_and_nothing_else(reach_check: bool) -> None:
    trace = press(35.0, 0.3, reach_check)
    ticks = settled(trace)
    delivered, tilt = float(trace.push_true[ticks].mean()), np.degrees(trace.euler[ticks, :2])
    height = float(np.ptp(trace.position[ticks, 2]))
    print(f"35 N: {delivered:.2f} N, height {1e3 * height:.1f} mm, tilt {np.abs(tilt).max():.2f} deg peak")
    assert trace.completed and delivered >= 0.95 * REACH_N
    assert height <= 0.05 and np.sqrt((tilt**2).mean()) <= 1.0 and np.abs(tilt).max() <= 2.0
    said = [event.text for event in trace.events if event.kind == "rejected"]
    assert any("reduced" in text and "reach" in text for text in said) is reach_check
