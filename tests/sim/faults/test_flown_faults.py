"""Whole flights with faults: they are watched after the end of the strategy, and a touchdown ends them."""

from __future__ import annotations

import numpy as np
import pytest

from sim.evaluate.measures import fault_figures
from sim.experiments.scenes import near_wall, short_job
from sim.faults.clock import LoopStall
from sim.faults.fault import NoFault
from sim.faults.rotors import ThrustLoss
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions

OPTIONS = FlightOptions(features="geometric", video=False)


@pytest.mark.slow
def test_a_watched_flight_goes_on_after_the_end_of_the_strategy_and_is_completed():
    fault = NoFault(after="retreat", delay_s=0.0, watch_s=4.0)
    trace = fly(short_job(0.2, rows=1), OPTIONS, faults=(fault,))
    figures = fault_figures(trace)
    assert trace.claimed and figures["end_s"] - figures["fault_s"] == pytest.approx(4.0, abs=0.01)
    assert trace.phases[trace.phase[-1]] == "done"


def test_a_slow_touchdown_ends_the_flight_as_landed():
    low = near_wall(board={"bottom_m": 0.5}, start={"down_m": 0.35})
    trace = fly(low, OPTIONS, faults=(ThrustLoss(after="start", delay_s=0.0, share=0.7),))
    assert trace.reason == "landed" and not trace.claimed
    assert fault_figures(trace)["landed"] == 1.0 and trace.t[-1] < 2.0


def test_a_stalled_loop_leaves_the_last_command_in_force_and_the_log_whole():
    trace = fly(near_wall(board={"bottom_m": 0.5}, start={"down_m": 0.35}), OPTIONS, faults=(
        LoopStall(after="start", delay_s=0.04, duration_s=0.2),
        ThrustLoss(after="start", delay_s=0.3, share=0.7),
    ))  # fmt: skip
    stalled = (trace.t >= 0.04) & (trace.t < 0.24)
    assert np.array_equal(trace.thrusts[stalled], np.tile(trace.thrusts[9], (np.count_nonzero(stalled), 1)))
    assert np.diff(trace.t) == pytest.approx(0.004)
    assert not np.array_equal(trace.thrusts[60], trace.thrusts[9])
