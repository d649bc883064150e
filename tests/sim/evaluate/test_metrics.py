"""Every figure of M on a synthetic flight with known errors."""

from __future__ import annotations

import dataclasses
import io
import math

import numpy as np
import pytest
from rich.console import Console
from synthetic_trace import PHYSICS_PER_TICK, TOUCH_S, Errors, synthetic_trace

from sim.evaluate.metrics import LINES, compute_metrics, figure_table
from sim.evaluate.paint_plan import band_mask, distance_to_polyline, nominal_plan, plan_as_painted
from sim.world.board import BoardGeometry
from sim.world.scene import BoardScene, PaintScene, Scene


@pytest.fixture(scope="module")
def metrics():
    return compute_metrics(synthetic_trace())


def test_path_errors_of_known_offsets(metrics):
    # Row 1 runs 2 mm too high; row 2 follows row 1 as painted and adds its own 3 mm.
    assert metrics["rows"][0]["path_rms_straight_m"] == pytest.approx(0.002, abs=1e-9)
    assert metrics["rows"][1]["path_rms_straight_m"] == pytest.approx(0.003, abs=1e-9)
    assert metrics["path_rms_straight_m"] == pytest.approx(math.sqrt((0.002**2 + 0.003**2) / 2), rel=1e-3)
    assert metrics["path_max_m"] == pytest.approx(0.003, abs=1e-9)
    assert metrics["height_error_rms_m"] == pytest.approx(math.sqrt((0.002**2 + 0.003**2) / 2), rel=1e-3)
    # Climbing exactly above the left end of row 1: the corner has less error than the rows.
    assert 0.0 < metrics["path_rms_corner_m"] < 0.003
    assert metrics["stroke_m"] == pytest.approx(1.30, abs=1e-3)


def test_row_below_moves_the_reference_not_the_error():
    """An error of row 1 is no error of row 2, whose guide is the paint."""
    trace = synthetic_trace(Errors(row_offset_m=(0.010, 0.0)))
    rows = compute_metrics(trace)["rows"]
    assert rows[0]["path_rms_straight_m"] == pytest.approx(0.010, abs=1e-9)
    assert rows[1]["path_rms_straight_m"] == pytest.approx(0.0, abs=1e-9)


def test_straight_and_corner_split_at_ten_centimetres():
    trace = synthetic_trace()
    painting = trace.row == 1
    tip = BoardGeometry(trace.scene).board_coordinates(trace.tip[:, 1:])
    inside = painting & (np.abs(tip[:, 0] - 0.70) < 0.5)
    trace.arrays["push_true"] = trace.push_true + 3.0 * inside
    metrics = compute_metrics(trace)["rows"][0]
    assert metrics["force_rms_corner_n"] == pytest.approx(0.2, abs=0.02)
    assert metrics["force_rms_straight_n"] > 2.0


def test_force_figures(metrics):
    assert metrics["force_rms_straight_n"] == pytest.approx(0.2, abs=1e-9)
    assert metrics["force_rms_corner_n"] == pytest.approx(0.2, abs=1e-9)
    assert metrics["force_peak_n"] == 6.5
    assert metrics["first_touch_s"] == pytest.approx(TOUCH_S, abs=1e-3)
    assert metrics["bounces"] == 2
    # The ramp rises 5 N/s from 0.2 N: inside 5 +- 0.5 N when the reference passes 4.3 N.
    assert metrics["settle_s"] == pytest.approx(0.86, abs=0.01)


def test_bounces_after_the_window_do_not_count():
    trace = synthetic_trace(Errors(bounces=0))
    trace.arrays["contact_1khz"][round((TOUCH_S + 3.2) * 1000)] = 0.0
    assert compute_metrics(trace)["bounces"] == 0


def test_contact_share_counts_milliseconds():
    demanded = int(synthetic_trace().painting_1khz.sum())
    metrics = compute_metrics(synthetic_trace(Errors(lost_steps=137)))
    assert metrics["contact_share"] == pytest.approx(1.0 - 137 / demanded, abs=1e-12)
    assert demanded % PHYSICS_PER_TICK == 0


def test_attitude_figures(metrics):
    assert metrics["tilt_rms_deg"] == pytest.approx(0.5, abs=1e-9)
    assert metrics["tilt_peak_deg"] == pytest.approx(0.5, abs=1e-9)
    assert metrics["yaw_peak_deg"] == pytest.approx(1.5, abs=1e-9)


def test_attitude_figures_skip_the_first_second():
    trace = synthetic_trace()
    trace.arrays["attitude"][:240] = [math.cos(0.2), math.sin(0.2), 0.0, 0.0]
    assert compute_metrics(trace)["tilt_peak_deg"] == pytest.approx(0.5, abs=1e-9)


def test_velocity_error_ignores_ticks_without_estimate(metrics):
    assert metrics["velocity_rms_m_s"] == pytest.approx(0.005, abs=1e-12)


def test_coverage():
    assert compute_metrics(synthetic_trace())["coverage"] == 1.0
    assert compute_metrics(synthetic_trace(Errors(unpainted_share=0.25)))["coverage"] == pytest.approx(0.75, abs=1e-3)


def test_band_area_is_exact():
    scene = Scene()
    paint = scene.paint
    mask = band_mask(scene, nominal_plan(scene), (1200, 2800), 2000.0)
    area = paint.stroke_m * (paint.brush_width_m + paint.pitch_m)  # rows and what lies between them
    outside = math.pi * paint.brush_width_m**2 / 4 * 1.5 + paint.brush_width_m / 2 * paint.pitch_m
    assert mask.sum() / 2000.0**2 == pytest.approx(area + outside, rel=0.01)
    assert mask.sum() / 2000.0**2 < area + outside


def test_outcomes_limits_and_times(metrics):
    trace = synthetic_trace()
    assert metrics["outcomes"]["solved"] == len(trace.t)
    assert metrics["outcomes"]["hold"] == 0
    assert metrics["limits"]["thrust_min:front_left"] == pytest.approx(0.25, abs=1e-3)
    assert metrics["step_us"] == {"p50": pytest.approx(45.0), "p99": pytest.approx(59.7), "max": 60.0}
    assert metrics["vision_ms"]["p50"] == pytest.approx(1.5)
    assert metrics["real_time_factor"] == pytest.approx(8.0, rel=1e-3)
    assert metrics["propeller_clearance_min_m"] == pytest.approx(0.09)


def test_slope_and_four_rows():
    scene = Scene(board=BoardScene(slope_deg=2.0), paint=PaintScene(rows=4, stroke_m=0.6))
    metrics = compute_metrics(synthetic_trace(Errors(row_offset_m=(0.001,) * 4), scene))
    assert [row["row"] for row in metrics["rows"]] == [1, 2, 3, 4]
    assert metrics["path_rms_straight_m"] == pytest.approx(0.001, abs=1e-9)
    assert metrics["stroke_m"] == pytest.approx(0.6, abs=1e-3)
    assert all(row["completed"] for row in metrics["rows"])


def test_partial_flight_has_a_short_stroke_and_no_row_two():
    trace = synthetic_trace()
    keep = trace.t < 8.0
    for name in ("contact_1khz", "painting_1khz"):
        trace.arrays[name] = trace.arrays[name][: PHYSICS_PER_TICK * keep.sum()]
    for name, values in trace.arrays.items():
        if len(values) == len(keep):
            trace.arrays[name] = values[keep]
    trace.claimed, trace.reason = False, "interrupted"
    metrics = compute_metrics(trace)
    assert metrics["stroke_m"] == 0.0
    assert [row["row"] for row in metrics["rows"]] == [1]
    assert not metrics["rows"][0]["completed"]
    assert metrics["rows"][0]["stroke_m"] == pytest.approx(0.2, abs=2e-3)


def test_flight_that_never_began():
    trace = synthetic_trace()
    for name, values in trace.arrays.items():
        trace.arrays[name] = values if name.startswith("thrust_") else values[:0]
    metrics = compute_metrics(trace)
    assert metrics["duration_s"] == 0.0 and metrics["stroke_m"] == 0.0 and metrics["rows"] == []
    assert math.isnan(metrics["tilt_rms_deg"])


def test_even_rows_end_where_the_row_below_ends():
    scene = Scene()
    tip = np.column_stack((np.linspace(1.30, 0.05, 200), np.full(200, 0.05)))
    plan = plan_as_painted(scene, {1: tip})
    assert plan.segments[0].points[0] == pytest.approx([1.35, 0.05])
    assert plan.segments[-1].points[-1, 0] == pytest.approx(1.30)


def test_distance_to_polyline():
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    points = np.array([[0.5, 0.2], [1.2, 0.5], [2.0, 2.0], [-1.0, 0.0]])
    expected = [0.2, 0.2, math.sqrt(2.0), 1.0]
    assert distance_to_polyline(points, corner) == pytest.approx(expected)


def test_metrics_do_not_change_the_trace():
    trace = synthetic_trace()
    before = {name: values.copy() for name, values in trace.arrays.items()}
    compute_metrics(dataclasses.replace(trace))
    assert all(np.array_equal(before[name], trace.arrays[name], equal_nan=True) for name in before)


def test_force_error_is_relative_to_the_commanded_push():
    """A push that the reach check lowered is no error if it was reached."""
    trace = synthetic_trace()
    for name in ("push_true", "push_reference"):
        trace.arrays[name] = trace.arrays[name] - 2.0 * (trace.row > 0)
    assert compute_metrics(trace)["force_rms_straight_n"] == pytest.approx(0.2, abs=1e-9)


def test_velocity_error_counts_the_known_components():
    trace = synthetic_trace()
    trace.arrays["velocity_estimate"][:, 1] = np.nan
    assert compute_metrics(trace)["velocity_rms_m_s"] == pytest.approx(0.003, abs=1e-12)


def test_canvas_starts_at_the_top_left():
    scene = Scene(paint=PaintScene(rows=1, stroke_m=0.5))
    mask = band_mask(scene, nominal_plan(scene), (600, 1400), 1000.0)
    # The row runs from 0.05 m to 0.55 m, 0.05 m above the bottom edge: rows 510..590 of 600.
    assert mask[549, 300] and mask[511, 300] and mask[588, 300] and mask[549, 12] and mask[549, 588]
    assert not mask[508, 300] and not mask[592, 300] and not mask[549, 592] and not mask[:500].any()


@pytest.mark.parametrize("laws", [("qp",), ("qp", "paper")])
def test_the_table_fits_80_columns_and_cuts_no_number(laws):
    scene = Scene(paint=PaintScene(rows=4))
    metrics = {law: compute_metrics(synthetic_trace(Errors(row_offset_m=(0.01, -0.05, 0.03, -0.06)), scene, law))
               for law in laws}  # fmt: skip
    for figures in metrics.values():
        figures |= {"first_touch_s": 12345.678, "force_peak_n": -1234567.891, "reason": "supercalifragilistic" * 4}
    Console(file=(text := io.StringIO()), width=80).print(figure_table(metrics))
    lines = text.getvalue().splitlines()
    assert max(map(len, lines)) <= 80 and "…" not in text.getvalue()
    words = text.getvalue().split()
    for figure in LINES:
        for figures in metrics.values():
            shown = figure.show(figures)
            if any(map(str.isdigit, shown)) and " " not in shown:
                assert shown in words or figure.name == "reason", figure.name
        assert set(figure.words.split()) <= set(words), figure.words
    assert "CLAIM)" in words and "row 3" in " ".join(words)
