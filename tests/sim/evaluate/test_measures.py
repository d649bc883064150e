"""Figures of presses, slides and faults on made-up flights with known results, and the reach of the rotors."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from press_trace import press_trace
from synthetic_trace import TOUCH_S, Errors, synthetic_trace

from sim.evaluate.measures import (
    fault_figures,
    loss_figures,
    paint_figures,
    paint_timed_figures,
    press_figures,
    push_reach,
)
from sim.evaluate.metrics import compute_metrics
from sim.flight.trace import Event
from sim.world.board import BoardGeometry
from sim.world.scene import PaintScene, Scene, SurfaceScene

LOW, HIGH = (1.2,) * 6, (52.56,) * 6


def test_figures_of_a_known_press():
    figures = press_figures(press_trace(settle_s=1.2, bias_n=0.1, bounces=2, peak_n=7.0, drop_m=0.003, roll_deg=0.4))
    assert figures["settle_s"] == pytest.approx(1.2, abs=0.002)
    assert figures["bounces"] == 2.0
    assert figures["touch_peak_n"] == 7.0
    assert figures["force_rms_n"] == pytest.approx(0.1)
    assert figures["push_mean_n"] == pytest.approx(5.1)
    assert figures["height_error_peak_m"] == pytest.approx(0.003)
    assert figures["tilt_rms_deg"] == pytest.approx(0.4)
    assert figures["first_touch_s"] == pytest.approx(2.0)
    assert figures["approach_speed_m_s"] == pytest.approx(0.02, rel=0.05)
    assert figures["contact_share"] == 1.0
    assert "recovery_s" not in figures


def test_a_push_outside_its_band_never_settles():
    assert math.isnan(press_figures(press_trace(bias_n=0.6))["settle_s"])


def test_recovery_counts_from_the_fault_for_good():
    figures = press_figures(press_trace(fault_s=6.0, back_s=0.8))
    assert figures["recovery_s"] == pytest.approx(0.8, abs=0.01)
    assert figures["fault_force_peak_n"] == pytest.approx(2.1, abs=0.01)
    assert math.isnan(press_figures(press_trace(fault_s=6.0, back_s=20.0))["recovery_s"])


def test_a_press_without_touch():
    trace = press_trace()
    trace.arrays["contact_1khz"] = np.zeros_like(trace.contact_1khz)
    assert press_figures(trace)["touched"] == 0.0


def test_reach_share_is_relative_to_reach_or_job():
    figures = press_figures(press_trace(bias_n=0.0))
    assert figures["reach_n"] == pytest.approx(30.4, abs=0.05)
    assert figures["reach_share"] == pytest.approx(1.0)
    trace = press_trace(bias_n=0.0)
    trace.arrays["true_thrust_max"] = np.full(6, 11.5)
    assert press_figures(trace)["reach_n"] < 1.0


@pytest.mark.parametrize(("friction", "reach"), [(0.0, 30.4), (0.3, 15.8), (0.8, 8.7)])
def test_reach_standing_and_sliding(friction, reach):
    assert push_reach(6.0, LOW, HIGH, friction) == pytest.approx(reach, abs=0.06)


def test_reach_with_derated_rotors():
    assert push_reach(6.0, LOW, (20.0,) * 6) == pytest.approx(13.0, abs=0.05)


def test_figures_of_a_lost_rotor_begin_at_the_loss():
    trace = press_trace(fault_s=6.0, roll_deg=3.0)
    trace.arrays["propeller_clearance"] = np.full(len(trace.t), 0.3)
    figures = loss_figures(trace)
    assert figures["survived_s"] == pytest.approx(6.0, abs=0.01)
    assert figures["tilt_peak_deg"] == pytest.approx(3.0)
    assert figures["detached"] == 0.0
    assert loss_figures(press_trace()) == {}


def test_a_descent_before_a_leaning_wall_is_along_gravity():
    trace = press_trace(fault_s=6.0)
    trace.arrays["propeller_clearance"] = np.full(len(trace.t), 0.3)
    trace.scene = dataclasses.replace(trace.scene, surface=SurfaceScene(lean_deg=10.0))
    down = BoardGeometry(trace.scene).down
    trace.arrays["position"] = np.outer(0.5 * trace.t, down)
    assert loss_figures(trace)["descent_peak_m_s"] == pytest.approx(0.5)


def test_a_spin_after_a_loss_counts_its_full_turns():
    trace = press_trace(fault_s=6.0)
    trace.arrays["propeller_clearance"] = np.full(len(trace.t), 0.3)
    turn = np.where(trace.t > 6.0, 2.0 * (trace.t - 6.0), 0.0)
    euler = trace.arrays["euler"].copy()
    euler[:, 2] = (turn + np.pi) % (2.0 * np.pi) - np.pi
    trace.arrays["euler"] = euler
    figures = loss_figures(trace)
    assert figures["yaw_turned_deg"] == pytest.approx(np.degrees(turn[-1]), rel=1e-3)
    assert figures["yaw_rate_peak_deg_s"] == pytest.approx(np.degrees(2.0), rel=1e-2)
    assert figures["push_spike_n"] == np.max(trace.contact_1khz[6000:])


def test_a_paint_job_tells_its_peak_and_its_crash():
    trace = synthetic_trace(Errors(peak_n=7.5))
    assert paint_figures(trace)["push_peak_ratio"] == pytest.approx(1.5) and paint_figures(trace)["crashed"] == 0.0
    trace.claimed, trace.reason = False, "crash: propeller strike"
    assert paint_figures(trace)["crashed"] == 1.0


def test_the_last_row_has_a_path_error_only_if_it_was_reached():
    scene = Scene(paint=PaintScene(rows=3, stroke_m=0.6))
    trace = synthetic_trace(Errors(row_offset_m=(0.001, 0.002, 0.004)), scene)
    straight = compute_metrics(trace)["rows"][2]["path_rms_straight_m"]
    assert paint_figures(trace)["path_rms_last_row_m"] == straight > 0.0
    trace.row[trace.row == 3] = 2
    assert math.isnan(paint_figures(trace)["path_rms_last_row_m"])


def test_the_rate_of_perception_is_that_of_the_median_picture():
    trace = synthetic_trace()
    trace.arrays["vision_ms"] = np.array([4.0, 5.0, 900.0])
    assert paint_timed_figures(trace)["perception_hz"] == pytest.approx(200.0)
    trace.arrays["vision_ms"] = np.zeros(0)
    assert math.isnan(paint_timed_figures(trace)["perception_hz"])


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
