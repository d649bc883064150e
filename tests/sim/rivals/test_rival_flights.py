"""Short closed-loop flights of the rivals: they paint."""

from __future__ import annotations

import pytest

from sim.evaluate.metrics import compute_metrics
from sim.experiments.design import Choice, design
from sim.experiments.scenes import short_job
from sim.experiments.spec import experiment
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.rivals import LEXICOGRAPHIC, MPC


@pytest.mark.slow
@pytest.mark.parametrize("rival", [LEXICOGRAPHIC, MPC])
def test_a_rival_paints(rival):
    options = FlightOptions(controller=rival, features="geometric", video=False, compiled=True)
    trace = fly(short_job(0.4, rows=1), options)
    assert trace.claimed, trace.reason
    figures = compute_metrics(trace)
    assert figures["path_rms_straight_m"] < 3e-3
    assert figures["force_rms_straight_n"] < 0.6
    assert figures["contact_share"] > 0.99
    assert figures["outcomes"]["analytic_fallback"] == 0


def test_the_experiment_flies_all_three_on_the_same_seeds():
    runs = design(experiment("rivals"), Choice())
    cells: dict[str, dict[str, set[int]]] = {}
    for run in runs:
        assert run.plan.options.controller == {"lexicographic": LEXICOGRAPHIC, "mpc": MPC}.get(run.variant, "")
        assert run.plan.config.controller.reach_check != (run.params["kind"] == "35 N")
        cells.setdefault(str(run.params), {}).setdefault(run.plan.options.controller, set()).add(run.seed)
    assert len(cells) == 5
    for cell in cells.values():
        assert set(cell) == {"", LEXICOGRAPHIC, MPC}
        assert all(seeds == set(range(10)) for seeds in cell.values())
