"""Figures of a flight with a fault, on a made-up flight with known values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from synthetic_trace import TOUCH_S, Errors, synthetic_trace

from sim.evaluate.measures import fault_figures
from sim.flight.trace import Event

FAULT_S = 8.0


def flight(*events, reason="", **arrays):
    """A flight of 5 N with a fault at 8 s and further events, its arrays changed."""
    trace = synthetic_trace(Errors(roll_deg=2.0, peak_n=6.5, bounces=0))
    trace.events += [Event(t=FAULT_S, kind="fault", text="made up"), *events]
    trace.arrays |= arrays
    trace.reason = reason or trace.reason
    return trace


def safety(t, text):
    return Event(t=t, kind="safety", text=text)


def test_worst_values_of_the_flight():
    trace = flight()
    tick = int(np.searchsorted(trace.t, FAULT_S))
    trace.velocity[tick] = [0.6, 0.8, 0.0]
    figures = fault_figures(trace)
    assert figures["tilt_peak_deg"] == pytest.approx(2.0) == figures["tilt_contact_deg"]
    assert figures["push_peak_n"] == 6.5 and figures["push_time_s"] == pytest.approx(TOUCH_S + 0.02)
    assert figures["speed_peak_m_s"] == pytest.approx(1.0)
    assert (figures["struck"], figures["fault_s"]) == (1.0, FAULT_S)
    assert figures["advance_m"] == pytest.approx(0.0, abs=1e-9)  # the tip stays at the board, then leaves it
    last = trace.t[trace.push_true > 0.05][-1]
    assert figures["touching_s"] == pytest.approx(last - FAULT_S, abs=0.005)


def test_a_tilt_in_free_air_is_no_tilt_in_contact():
    trace = flight()
    free = trace.t < TOUCH_S - 0.1
    trace.attitude[free] = [math.cos(0.1), math.sin(0.1), 0.0, 0.0]
    figures = fault_figures(trace)
    assert figures["tilt_peak_deg"] == pytest.approx(math.degrees(0.2))
    assert figures["tilt_contact_deg"] == pytest.approx(2.0)


def test_commands_out_of_their_limits_are_counted():
    trace = flight()
    assert fault_figures(trace)["box_excess_n"] == 0.0 == fault_figures(trace)["bad_thrusts"]
    trace.thrusts[500, 2], trace.thrusts[900, 0], trace.thrusts[700] = 53.0, 1.0, np.nan
    figures = fault_figures(trace)
    assert figures["bad_thrusts"] == 1.0
    assert figures["box_excess_n"] == pytest.approx(53.0 - 52.56)
    assert figures["rate_peak_n_s"] > 40.0 / 0.004


def test_states_are_told_apart_before_and_after_the_fault():
    trace = flight(
        safety(2.0, "degraded: camera: no picture for 0.3 s"),
        safety(2.5, "nominal: "),
        safety(8.2, "retreat: camera: no picture for 0.7 s; lines lost"),
        safety(9.0, "hover: "),
    )
    figures = fault_figures(trace)
    assert (figures["state_before"], figures["state"]) == (1.0, 3.0)
    assert figures["to_degraded_s"] == figures["to_retreat_s"] == pytest.approx(0.2)
    assert figures["to_hover_s"] == pytest.approx(1.0) and math.isnan(figures["to_descend_s"])
    assert figures["unexplained"] == 1.0  # the hover has no reason; a return to nominal needs none


def test_ends_of_flights():
    assert fault_figures(flight(reason="crash: hit the ground"))["crashed"] == 1.0
    landed = fault_figures(flight(reason="landed"))
    assert (landed["crashed"], landed["landed"]) == (0.0, 1.0)


def test_a_flight_without_the_fault_says_so():
    trace = synthetic_trace()
    figures = fault_figures(trace)
    assert figures["struck"] == 0.0 and math.isnan(figures["fault_s"]) and math.isnan(figures["advance_m"])
    trace.arrays["t"] = trace.t[:0]
    assert fault_figures(trace) == {"struck": 0.0}


def test_a_rotor_deviates_once_its_command_is_another_behind_the_motor_lag():
    trace = flight()
    trace.arrays |= {name: np.full(trace.thrusts.shape, 12.0) for name in ("thrusts", "thrusts_actual")}
    assert math.isnan(fault_figures(trace)["deviates_s"])
    tick = int(np.searchsorted(trace.t, FAULT_S + 1.0))
    trace.thrusts[tick:, 2] = 16.0  # 1 - exp(-t / 45 ms) = 2.5 / 4 after 44 ms
    assert fault_figures(trace)["deviates_s"] == pytest.approx(1.044, abs=0.006)
