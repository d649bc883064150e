"""Whole flights with the C library in closed loop: the main job, with the figures of the same flights in Python."""

from __future__ import annotations

from typing import Any

import joblib
import pytest
from c_library import needs_compiler

from sim.evaluate.figures import FIGURES
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.world.scene import Scene
from sim.world.worlds import in_world

pytestmark = [pytest.mark.slow, needs_compiler]

#: Ticks of a flight that may fly by the analytic law where the solver computes with floats.
LEFT_OUT = 50
NAMES = ("path_rms_straight_m", "force_rms_straight_n", "tilt_rms_deg")
SEEDS = 2


def paint(seed: int, **library: Any) -> tuple[bool, str, dict[str, Any]]:
    trace = fly(in_world(Scene(), "datasheet"), FlightOptions(features="geometric", seed=seed, video=False, **library))
    return trace.claimed, trace.reason, compute_metrics(trace)


def test_the_main_job_flies_with_the_library_as_with_python() -> None:
    laws: list[dict[str, Any]] = [{}]
    laws += [{"controller": "c_flown:CFlown", "controller_settings": single} for single in (False, True)]
    jobs = [joblib.delayed(paint)(seed, **law) for law in laws for seed in range(SEEDS)]
    flights = joblib.Parallel(n_jobs=2)(jobs)
    python = flights[:SEEDS] * len(laws)
    for (completed, reason, figures), (_, _, expected), single in zip(
        flights, python, [False] * 4 + [True] * 2, strict=True
    ):
        assert completed, reason
        outcomes = figures["outcomes"]
        # OSQP in floats may miss its tolerance once in a flight; the analytic law then flies until it is solved again.
        assert outcomes["hold"] == 0 and outcomes["analytic_fallback"] <= (LEFT_OUT if single else 0)
        for name in NAMES:  # doubles give Python's thrusts but for their last bits
            least = FIGURES[name].least[0] / FIGURES[name].scale
            assert figures[name] == pytest.approx(expected[name], abs=least if single else 0.1 * least), name
