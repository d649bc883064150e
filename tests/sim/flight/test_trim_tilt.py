"""A push beyond the level reach, while the tip slides against a friction of 0.8: delivered with 2 degrees of tilt."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

from sim.evaluate.explanation import explain_tick, flown_config, trim_tilt
from sim.evaluate.explanation_text import explanation_tables
from sim.evaluate.measures import slide_figures
from sim.evaluate.window import phase_window
from sim.flight.closed_loop import fly
from sim.flight.jobs import PressJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.trace import Trace
from sim.world.scene import Scene
from sim.world.worlds import in_world

PUSH_N, FRICTION = 10.0, 0.8


@functools.cache
def slide(trim_deg: float, law: str = "qp") -> Trace:
    """Ideal sensors, no reach check."""
    scene = in_world(Scene(), "ideal")
    scene = dataclasses.replace(
        scene,
        paint=dataclasses.replace(scene.paint, push_n=PUSH_N),
        wall=dataclasses.replace(scene.wall, friction=FRICTION),
        start=dataclasses.replace(scene.start, distance_m=0.15),
    )
    options = FlightOptions(law=law, video=False, features="geometric", compiled=True)
    config = pilot_config(scene, options)
    limits = dataclasses.replace(config.controller.limits, trim_deg=trim_deg)
    controller = dataclasses.replace(config.controller, reach_check=False, limits=limits)
    config = dataclasses.replace(config, controller=controller)
    return fly(scene, options, config=config, job=PressJob(hold_s=3.0, slide_s=5.0))


@pytest.mark.slow
@pytest.mark.parametrize("law", ["qp", "paper"])
def test_two_degrees_deliver_what_level_flight_cannot(law: str) -> None:
    figures = slide_figures(slide(2.0, law))
    assert figures["force_error_rms_n"] < 0.15
    assert figures["reach_n"] < 9.0 and figures["push_mean_n"] > 9.85
    assert figures["tilt_peak_deg"] < 3.5 and figures["stuck_share"] < 0.1


@pytest.mark.slow
def test_level_flight_does_not() -> None:
    assert slide_figures(slide(0.0))["force_error_rms_n"] > 1.0


@pytest.mark.slow
def test_the_explanation_states_what_the_tilt_buys() -> None:
    trace = slide(2.0)
    begin, end = phase_window(trace, "paint")
    tick = int(np.searchsorted(trace.t, 0.5 * (begin + end)))
    config, explanation = explain_tick(trace, tick)
    trim = trim_tilt(trace, tick, config)
    assert trim is not None and trim.reach_n - trim.level_reach_n > 1.0 and trim.reach_n > 0.97 * PUSH_N
    headline = [text for text in explanation_tables(trace, tick, explanation, config) if isinstance(text, str)]
    assert any("of roll and" in text and "N of reach" in text for text in headline)
    assert trim_tilt(slide(0.0), tick, flown_config(slide(0.0))) is None
