"""Painting with unreported noise: the corners of the noise sweep, in closed loop."""

from __future__ import annotations

import pytest

from sim.evaluate.measures import paint_figures
from sim.evaluate.truth import Assessment
from sim.experiments.scenes import short_job
from sim.experiments.spec import experiment
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.world.scene import Scene

STROKE_M = 0.5


def bound(metric: str, **where: float) -> float:
    """Bound of the noise sweep on a metric in cells with these parameters."""
    criteria = experiment("noise-sweep").every_criterion()
    return next(each.bound for each in criteria if (each.metric, each.where) == (metric, where))


def noisy(sigma_vs: float, sigma_f: float, sigma_nm: float = 0.005) -> Scene:
    force_torque = {"sigma_n": sigma_f, "sigma_nm": sigma_nm}
    return short_job(STROKE_M, features={"sigma_vs": sigma_vs}, force_torque=force_torque)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["qp", "paper"])
@pytest.mark.parametrize(("vs", "force"), [(0.02, 3.0), (0.12, 1.0), (0.12, 3.0)])
def test_corners_of_the_noise_sweep(vs: float, force: float, law: str) -> None:
    """Held for the QP law; the analytic law has the same lines and forces and must come home as well.

    At the largest noise of vision it knows the places of its rows to 2 mm only, which it need not claim. There both
    laws claim rows that are 12 to 20 mm short by the truth, where 10 are allowed: no reported noise explains it.
    """
    trace = fly(noisy(vs, force), FlightOptions(law=law, video=False))
    assert trace.phases[int(trace.phase[-1])] == "done"
    assert trace.claimed or vs > 0.1, trace.reason
    if vs < 0.1:
        assert Assessment(trace).completed or not trace.claimed
    figures = paint_figures(trace)
    assert figures["contact_share"] >= 0.995
    if law == "qp":
        assert figures["path_rms_m"] <= bound("path_rms_m", sigma_vs=vs)
        assert figures["force_rms_n"] <= bound("force_rms_n", sigma_f_n=force)


@pytest.mark.slow
def test_moments_as_noisy_as_the_forces() -> None:
    """Moments noisy in the same proportion, 0.15 N m at 3 N, still measure the force across the tool better."""
    trace = fly(noisy(0.02, 3.0, sigma_nm=0.15), FlightOptions(law="qp", video=False))
    assert trace.claimed, trace.reason
    assert paint_figures(trace)["path_rms_m"] <= bound("path_rms_m", sigma_vs=0.02)
