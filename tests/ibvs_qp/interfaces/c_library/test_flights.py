"""Whole flights with the C library in closed loop: the main job, with figures inside those of the record."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import joblib
import numpy as np
import polars as pl
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
RECORD = Path(__file__).parents[4] / "docs" / "experiments" / "all.parquet"
NAMES = ("path_rms_straight_m", "force_rms_straight_n", "tilt_rms_deg")
#: Flights with doubles, which give Python's thrusts, and with floats.
SEEDS = {False: 2, True: 4}


def paint(seed: int, single: bool) -> tuple[bool, str, dict[str, Any]]:
    options = FlightOptions(controller="c_flown:CFlown", controller_settings=single, seed=seed, video=False)
    trace = fly(in_world(Scene(), "datasheet"), options)
    return trace.claimed, trace.reason, compute_metrics(trace)


@pytest.mark.parametrize("single", [False, True])
def test_the_main_job_flies_with_the_library_as_the_record_says(single: bool) -> None:
    record = pl.read_parquet(RECORD).filter(
        (pl.col("experiment") == "paint")
        & (pl.col("law") == "qp")
        & (pl.col("variant") == "standard")
        & (pl.col("param.world") == "datasheet")
    )
    assert len(record) == 10
    flights = joblib.Parallel(n_jobs=2)(joblib.delayed(paint)(seed, single) for seed in range(SEEDS[single]))
    for completed, reason, figures in flights:
        assert completed, reason
        outcomes = figures["outcomes"]
        # OSQP in floats may miss its tolerance once in a flight; the analytic law then flies until it is solved again.
        assert outcomes["hold"] == 0 and outcomes["analytic_fallback"] <= (LEFT_OUT if single else 0)
    for name in NAMES:
        recorded, flown = record[name].to_numpy(), np.median([figures[name] for _, _, figures in flights])
        print(f"{name}: {flown:.4g}, record {recorded.min():.4g} to {recorded.max():.4g}")
        # The record is of another law; less is no fault, nor is more that does not matter in practice.
        assert flown <= recorded.max() + FIGURES[name].least[0] / FIGURES[name].scale
