"""A tip that friction holds where no line fixes its place sideways: the vehicle must not rock about it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ibvs_qp.config import ControllerConfig
from ibvs_qp.setpoints import wall
from sim.closed_loop import FlightOptions, fly, pilot_config
from sim.experiments.scenes import near_wall
from sim.jobs import PressJob
from sim.trace import Trace

#: Nothing upright in the picture: the brush is half a metre off the right edge.
SCENE = near_wall(paint={"push_n": 20.0}, start={"right_m": -0.5})


def press(tick_s: float = 0.004) -> Trace:
    options = FlightOptions(law="qp", seed=1, features="geometric", video=False)
    pilot = pilot_config(SCENE, options)
    pilot = replace(pilot, controller=replace(pilot.controller, tick_s=tick_s))
    return fly(SCENE, options, config=pilot, job=PressJob(hold_s=9.0))


def held(trace: Trace) -> np.ndarray:
    """Ticks of the last 3 s of the press."""
    return np.flatnonzero(np.array(trace.phases)[trace.phase] == "press")[-750:]


def rocking(trace: Trace) -> float:
    """Largest yaw while held [deg]."""
    return float(np.degrees(np.abs(trace.euler[held(trace), 2])).max())


def test_a_held_tip_is_no_pivot_to_rock_about() -> None:
    trace = press()
    assert trace.completed
    assert rocking(trace) < 0.5
    assert trace.push_true[held(trace)].mean() == pytest.approx(20.0, abs=0.5)


def test_without_the_softer_yaw_it_would_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wall, "HELD_SHARE", 1e3)
    assert rocking(press(tick_s=0.004 + 1e-12)) > 1.0  # another configuration: controllers are kept by theirs


def test_the_gain_of_a_held_vehicle_is_a_third_of_the_stability_limit() -> None:
    config = ControllerConfig()
    vehicle, gains = config.vehicle, config.gains
    swing = vehicle.mass_kg * 0.7**2 * (0.0575 + 1.0 / (16.0 * np.pi))
    limit = gains.yaw_kd * (vehicle.inertia_kg_m2[2] / swing + gains.velocity_kp)
    assert wall.held_yaw_gain(config) == pytest.approx(limit / 3.0)
    assert wall.held_yaw_gain(config) < gains.yaw_kp
