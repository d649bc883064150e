"""The log level ``trace``: every figure computed from the file is that of the flight."""

from __future__ import annotations

import math

import numpy as np
import pytest
from press_trace import press_trace
from synthetic_trace import Errors, synthetic_trace

from ibvs_qp.config.files import UnreadableFile
from ibvs_qp.config.settings import dump_toml
from sim.evaluate.measures import fault_figures, loss_figures, paint_figures, press_row, slide_figures
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.flight_log import load_run, save_log
from sim.flight.options import FlightOptions
from sim.flight.trace import FIELDS, FIGURE_INPUTS, Trace
from sim.flight.trace_log import load_trace, save_trace
from sim.world.board import BoardGeometry
from sim.world.scene import BoardScene, PaintScene, Scene, StartScene

#: Single precision, 6e-8 of a signal; differences of signals lose some of it.
ROUNDING = 1e-5
#: Most that a trace may need per second of flight [kB/s].
MOST_KB_S = 40.0


def same(first: object, second: object, place: str = "") -> None:
    """Assert that figures are equal up to the rounding of the signals."""
    if isinstance(first, dict):
        assert isinstance(second, dict) and first.keys() == second.keys()
        for name in first:
            same(first[name], second[name], f"{place}.{name}")
    elif isinstance(first, list):
        assert isinstance(second, list) and len(first) == len(second)
        for at, (one, other) in enumerate(zip(first, second, strict=True)):
            same(one, other, f"{place}[{at}]")
    elif isinstance(first, float):
        assert second == pytest.approx(first, rel=ROUNDING, abs=1e-8, nan_ok=True), place
    else:
        assert first == second, place


def stored(trace: Trace, folder) -> tuple[Trace, float]:
    """The trace read back, and the size of its file per second of flight [kB/s]."""
    save_trace(folder / "one.trace.npz", trace)
    return load_trace(folder / "one.trace.npz"), (folder / "one.trace.npz").stat().st_size / 1e3 / float(trace.t[-1])


@pytest.fixture(scope="module")
def flown() -> Trace:
    """A short paint job, really flown."""
    board, paint = BoardScene(width_m=0.4), PaintScene(stroke_m=0.3)
    scene = Scene(board=board, paint=paint, start=StartScene(distance_m=0.15))
    return fly(scene, FlightOptions(features="geometric", video=False))


@pytest.mark.slow
def test_figures_of_a_real_flight_survive(flown, tmp_path):
    again, kb_s = stored(flown, tmp_path)
    assert kb_s <= MOST_KB_S
    assert set(again.arrays) == set(FIGURE_INPUTS) < set(FIELDS)
    assert np.array_equal(again.t, flown.t)
    same(compute_metrics(flown), compute_metrics(again))
    for measure in (paint_figures, fault_figures):
        same(measure(flown), measure(again))


def test_a_real_job_is_completed_by_the_truth_and_claimed(flown):
    metrics = compute_metrics(flown)
    assert metrics["claimed"] and metrics["completed"] and metrics["not_completed"] is None, metrics["not_completed"]
    assert metrics["push_reduced"] is None and metrics["off_board_share"] == 0.0
    assert metrics["push_asked_n"] == 5.0 and abs(metrics["push_flown_n"] - 5.0) < 0.25
    assert abs(metrics["place_error_m"]) <= 0.008 and all(row["completed"] for row in metrics["rows"])


@pytest.mark.parametrize("trace", [synthetic_trace(Errors(noise=0.3, lost_steps=7, unpainted_share=0.3)),
                                   synthetic_trace(Errors(row_offset_m=(0.0, 0.05)))])  # fmt: skip
def test_figures_of_made_up_flights_survive(trace, tmp_path):
    same(compute_metrics(trace), compute_metrics(stored(trace, tmp_path)[0]))


def test_figures_of_presses_and_losses_survive(tmp_path):
    trace = press_trace(bounces=2, fault_s=6.0, roll_deg=0.4)
    full = synthetic_trace()
    extra = {"thrusts", "row", "propeller_clearance", "velocity", "friction_true"}
    count = len(trace.t)
    for name in extra:
        trace.arrays[name] = np.resize(full.arrays[name], (count, *full.arrays[name].shape[1:]))
    trace.arrays["painting_1khz"] = np.zeros(4 * count, bool)
    trace.plan = {"press": 8.0, "paint": 0.0, "descend": 5.0}
    again, _ = stored(trace, tmp_path)
    assert again.plan == trace.plan and [vars(event) for event in again.events] == [vars(e) for e in trace.events]
    for measure in (press_row, loss_figures, slide_figures):
        same(measure(trace), measure(again))


def test_coverage_on_the_bound_does_not_move(tmp_path):
    trace = synthetic_trace()
    trace.coverage_mask = np.where(trace.coverage_mask > 0.5, np.float32(0.501), np.float32(0.499))
    again, _ = stored(trace, tmp_path)
    assert compute_metrics(again)["coverage"] == compute_metrics(trace)["coverage"] == 1.0
    assert not ((again.coverage_mask > 0.5) ^ (trace.coverage_mask > 0.5)).any()


def test_a_flight_that_never_began_is_a_trace_too(tmp_path):
    trace = synthetic_trace()
    for name, values in trace.arrays.items():
        trace.arrays[name] = values if "thrust_m" in name or name == "true_mass" else values[:0]
    save_trace(tmp_path / "empty.npz", trace)
    again = load_trace(tmp_path / "empty.npz")
    assert len(again.t) == 0 and math.isnan(compute_metrics(again)["tilt_rms_deg"])


def test_another_file_is_refused_by_name(tmp_path):
    np.savez_compressed(tmp_path / "other.npz", t=np.zeros(3))
    with pytest.raises(UnreadableFile, match="no array 'law'"):
        load_trace(tmp_path / "other.npz")


def test_the_board_of_a_slope_comes_back(tmp_path):
    scene = Scene(board=BoardScene(slope_deg=2.0))
    again, _ = stored(synthetic_trace(scene=scene), tmp_path)
    assert again.scene == scene and np.allclose(BoardGeometry(again.scene).along, BoardGeometry(scene).along)


def test_a_log_from_before_the_truth_loads_with_its_claim(tmp_path):
    trace = synthetic_trace()
    save_log(tmp_path / "log.npz", {"qp": trace})
    with np.load(tmp_path / "log.npz") as log:
        older = {name: log[name] for name in log.files if name not in ("qp/plan", "qp/legs")}
    np.savez_compressed(tmp_path / "log.npz", **older)
    (tmp_path / "scene.toml").write_text(dump_toml(trace.scene))
    again = load_run(tmp_path)["qp"]
    assert again.claimed and again.plan == {} and compute_metrics(again)["completed"]
