"""Contract of the commands: summary.json, by a checker that names the first wrong entry, and a refusal in one line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import pytest

from sim.commands.cli import main

#: Lines of work in progress: kernels may be compiled before a file is opened.
WORKING = re.compile(r"^.* \.\.\. \(\d+ s\)\n", re.MULTILINE)
NUMBER = (int, float, type(None))  # non-finite numbers are null
M_NUMBERS = (
    "duration_s real_time_factor stroke_m path_rms_straight_m path_rms_corner_m path_max_m force_rms_straight_n "
    "force_rms_corner_n force_peak_n contact_share tilt_rms_deg tilt_peak_deg yaw_rms_deg yaw_peak_deg "
    "height_error_rms_m coverage velocity_rms_m_s propeller_clearance_min_m first_touch_s settle_s bounces "
    "push_asked_n push_commanded_n push_flown_n place_error_m overlap_m off_board_share"
).split()
OUTCOMES = {"solved", "inaccurate_accepted", "capped_accepted", "exact_fallback", "analytic_fallback", "hold"}


def check_metrics(metrics: dict[str, Any], row: bool = False) -> None:
    """Assert that M, or a row of it, has every key of the contract with the right type."""
    assert isinstance(metrics["completed"], bool) and isinstance(metrics["claimed"], bool)
    assert isinstance(metrics["reason"], str)
    assert all(metrics[name] is None or isinstance(metrics[name], str) for name in ("not_completed", "push_reduced"))
    for name in M_NUMBERS:
        assert isinstance(metrics[name], NUMBER) and not isinstance(metrics[name], bool), name
    assert set(metrics["outcomes"]) <= OUTCOMES
    assert all(isinstance(ticks, int) for ticks in metrics["outcomes"].values())
    assert all(isinstance(share, NUMBER) for share in metrics["limits"].values())
    assert set(metrics["step_us"]) == {"p50", "p99", "max"}
    assert set(metrics["vision_ms"]) == {"p50", "p99"}
    if row:
        assert isinstance(metrics["row"], int)
    else:
        for entry in metrics["rows"]:
            check_metrics(entry, row=True)


def check_summary(summary: dict[str, Any], laws: set[str]) -> None:
    """Assert that summary.json follows the contract."""
    assert summary["schema"] == 1
    kinds = {
        "command": str,
        "version": str,
        "seed": int,
        "scene": str,
        "world": str,
        "preset": (str, type(None)),
        "run_dir": str,
        "camera": str,
        "image_size": list,
        "features": str,
        "vision": str,
        "interrupted": bool,
        "wall_time_s": float,
        "peak_memory_bytes": int,
        "laws": dict,
    }
    assert set(summary) == {"schema", *kinds}
    for key, kind in kinds.items():
        assert isinstance(summary[key], kind), key
    assert len(summary["image_size"]) == 2 and all(isinstance(size, int) for size in summary["image_size"])
    assert set(summary["laws"]) == laws
    for metrics in summary["laws"].values():
        check_metrics(metrics)


def refusal(words: Sequence[str], captured: pytest.CaptureFixture[str]) -> str:
    """Message of a refused command: exit code 2, one short line beside those of work, nothing on standard output."""
    assert main(list(words)) == 2
    out, err = captured.readouterr()
    err = WORKING.sub("", err)
    assert out == "" and err.startswith("ibvs-qp: error: ") and err.count("\n") == 1 and len(err) < 2000, err
    return err
