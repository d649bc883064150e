"""Stored flights scored again: only what follows from their figures."""

from __future__ import annotations

import polars as pl
import pytest

from sim.evaluate.measures import paint_figures
from sim.experiments.design import Choice, design
from sim.experiments.page import _claims
from sim.experiments.score_again import FAILS, HOLDS, OPEN, score, scored, section
from sim.experiments.spec import experiment
from sim.sweep.design import Run
from sim.sweep.parts import PARAM


def run_of(name: str, **params: object) -> Run:
    runs = design(experiment(name), Choice(features="geometric"))
    return next(run for run in runs if params.items() <= run.params.items() and run.law == "qp")


PAINT = {"contact_share": 1.0, "stroke_m": 1.3, "coverage": 0.98, "height_error_rms_m": 0.002}


@pytest.mark.parametrize(("figures", "outcome"), [
    ({}, (HOLDS, "")),
    ({"height_error_rms_m": 0.005}, (OPEN, "place of a stroke")),  # two rows, each up to 7 mm from the one before
    ({"contact_share": 0.97}, (FAILS, "contact")),
    ({"stroke_m": 1.285}, (FAILS, "length of the shortest stroke")),
    ({"stroke_m": 1.315}, (FAILS, "length of the shortest stroke")),
    ({"coverage": 0.85}, (FAILS, "coverage")),
])  # fmt: skip
def test_a_paint_job(figures, outcome):
    run = run_of("paint", world="ideal")
    assert run.measure is paint_figures or run.measure.__name__ == "paint_timed_figures"
    assert score(PAINT | figures, run) == outcome


def test_a_press_and_a_slide():
    slide = run_of("friction", friction=0.3)
    assert score({"hold_touched": 1.0, "speed_m_s": 0.09}, slide) == (HOLDS, "")
    assert score({"hold_touched": 1.0, "speed_m_s": 0.04}, slide) == (FAILS, "way of the slide")
    assert score({"hold_touched": 0.0}, slide) == (FAILS, "touch")


def test_only_claimed_flights_are_judged_and_listed():
    run = run_of("paint", world="ideal")
    facts = {"experiment": "paint", "law": "qp", "variant": run.variant, "seed": run.seed}
    facts |= {PARAM + name: value for name, value in run.params.items()}
    table = pl.DataFrame([facts | PAINT | {"completed": True, "stroke_m": 1.2}, facts | PAINT | {"completed": False}])
    found = scored(table, [run])
    assert found["outcome"].to_list() == [FAILS]
    assert "| paint | qp | 1 | 0 | 1 | 0 | length of the shortest stroke (standard: 1) |" in section(found)


def test_the_page_says_how_many_flights_were_judged():
    old, new = pl.DataFrame({"completed": [True]}), pl.DataFrame({"completed": [True, False], "claimed": [True, True]})
    assert "1 of 2 flights" in _claims([old, new]) and "\n1 flights are older" in _claims([old, new])
    assert "older" not in _claims([new])
