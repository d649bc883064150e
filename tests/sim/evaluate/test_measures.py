"""Figures of presses and slides on synthetic traces with known results, and the reach of the rotors."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from press_trace import press_trace
from synthetic_trace import Errors, synthetic_trace

from sim.evaluate.measures import loss_figures, paint_figures, paint_timed_figures, press_figures
from sim.evaluate.measures.press import push_reach
from sim.evaluate.metrics import compute_metrics
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
