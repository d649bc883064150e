"""Medians, intervals, paired differences and verdicts of small tables whose answers are known."""

from __future__ import annotations

import json
import math

import numpy as np
import polars as pl
import pytest

from ibvs_qp.config.errors import ConfigError
from sim.experiments import NAMES
from sim.experiments.design import Choice, designs
from sim.experiments.spec import EVERY, Criterion, experiment
from sim.experiments.verdict import evaluate
from sim.report.comparison import compare, read_run
from sim.sweep.parts import frame, write_table
from sim.sweep.statistics import cells, exact_interval, median_interval, needed, paired_differences, sign, spread


def table(values: dict[str, list[float]], name: str = "error", **params: float) -> pl.DataFrame:
    rows = [
        {"experiment": "x", "law": law, "variant": "standard", "seed": seed, "completed": True, name: value}
        | {f"param.{key}": entry for key, entry in params.items()}
        for law, column in values.items()
        for seed, value in enumerate(column)
    ]
    return frame(rows)


def test_interval_of_the_median_covers_it_and_repeats_itself():
    values = np.random.default_rng(1).normal(3.0, 0.5, 40)
    first, second = median_interval(values), median_interval(values)
    assert first == second
    assert first["low"] < first["median"] == np.median(values) < first["high"]
    assert first["high"] - first["low"] < 0.8


def test_intervals_cover_the_true_median_as_often_as_they_say():
    rng = np.random.default_rng(5)
    inside = 0
    for _ in range(120):
        interval = median_interval(rng.normal(0.0, 1.0, 15))
        inside += interval["low"] <= 0.0 <= interval["high"]
    assert 0.88 <= inside / 120 <= 1.0


@pytest.mark.parametrize("count", [2, 5])
def test_fewer_than_six_values_have_minimum_and_maximum_and_say_so(count: int):
    values = np.array([3.0, 1.0, 7.0, 2.0, 5.0, 4.0])
    few, enough = values[:count], median_interval(values)
    assert median_interval(few) == {"median": np.median(few), "low": few.min(), "high": few.max()}
    assert spread("1", "7", count) == "min 1, max 7" and spread("1", "7", needed()) == "1 to 7"
    assert (enough["low"], enough["high"]) != (values.min(), values.max()) and needed() == 6


def test_few_values_make_no_interval():
    assert median_interval(np.array([2.0])) == {"median": 2.0, "low": 2.0, "high": 2.0}
    assert median_interval(np.array([1.0, 1.0, np.nan])) == {"median": 1.0, "low": 1.0, "high": 1.0}
    assert math.isnan(median_interval(np.array([np.nan]))["median"])


def test_pairing_finds_a_small_difference_that_the_spread_hides():
    rng = np.random.default_rng(2)
    common = rng.normal(10.0, 5.0, 12)
    data = table({"qp": list(common), "paper": list(common + 0.3 + rng.normal(0.0, 0.05, 12))}, push=5.0)
    found = paired_differences(data)[0]
    difference = found["differences"]["error"]
    assert found["params"] == {"push": 5.0} and found["n"] == 12
    assert 0.2 < difference["low"] <= difference["median"] <= difference["high"] < 0.4
    by_law = {cell["law"]: cell["metrics"]["error"] for cell in cells(data)}
    assert by_law["qp"]["high"] > by_law["paper"]["low"]


def test_seeds_that_one_law_did_not_fly_are_left_out():
    data = table({"qp": [1.0, 2.0, 3.0], "paper": [1.5, 2.5]})
    assert paired_differences(data)[0]["n"] == 2


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 3, 4, 5, 6, 8, 10, 30])
def test_an_interval_that_excludes_zero_is_rarely_wrong_and_never_comes_of_too_few_pairs(count: int):
    values = np.random.default_rng(9).normal(0.0, 1.0, (600, count))
    wrong = np.mean([low > 0.0 or high < 0.0 for low, high in map(exact_interval, values)])
    assert wrong <= (0.065 if count >= needed() else 0.0)
    assert needed() == 6
    assert exact_interval(np.arange(1.0, 7.0)) == (1.0, 6.0)


def test_flights_that_a_law_did_not_end_are_failures_and_no_differences():
    data = table({"qp": [1.0, 1.0, 1.0], "paper": [2.0, 90.0, 2.0]})
    data = data.with_columns(pl.Series("completed", [True, True, False, True, False, True]))
    found = paired_differences(data)[0]
    assert (found["flown"], found["n"], found["failed"]) == (3, 1, [1, 1])
    assert found["differences"]["error"]["median"] == 1.0 and sign(found["differences"]["error"]) == 0
    by_law = {cell["law"]: cell["metrics"]["error"]["median"] for cell in cells(data)}
    assert by_law == {"qp": 1.0, "paper": 2.0}
    lived = {cell["law"]: cell["metrics"]["error"]["median"] for cell in cells(data, of_all=("error",))}
    assert lived["paper"] == 2.0 and len(lived) == 2


def test_cells_keep_the_order_and_count_failures():
    data = pl.concat([table({"qp": [1.0]}, push=20.0), table({"qp": [2.0, 3.0]}, push=5.0)])
    data = data.with_columns(pl.Series("completed", [True, False, True]))
    listed = cells(data)
    assert [cell["params"]["push"] for cell in listed] == [20.0, 5.0]
    assert [(cell["n"], cell["completed"]) for cell in listed] == [(1, 1), (2, 1)]


def judged(values: list[float], completed: list[bool] | None = None, **criterion):
    data = table({"qp": values})
    if completed:
        data = data.with_columns(pl.Series("completed", completed))
    return evaluate(Criterion(text="", metric="error", **criterion), {}, data, {})


def test_a_bound_is_held_by_the_median_and_counted_per_flight():
    verdict = judged([0.1, 0.2, 0.9], at_most=0.5)
    assert verdict.met and (verdict.within, verdict.n, verdict.worst) == (2, 3, 0.9)
    assert not judged([0.6, 0.7, 0.1], at_most=0.5).met
    assert judged([0.97, 0.99], at_least=0.95).met


def test_what_must_never_happen_must_hold_in_every_flight():
    flags = [1.0, 1.0, 0.0]
    assert not judged(flags, at_least=1.0, statistic=EVERY).met
    lenient = judged(flags, at_least=1.0)
    assert lenient.met and lenient.words == "yes (median; 2 of 3)"
    assert judged([1.0, 1.0], at_least=1.0, statistic=EVERY).words == "yes"
    assert judged([5.0, 9.0, 5.1], at_most=6.5, statistic=EVERY).words == "no"


@pytest.mark.parametrize("name", NAMES)
def test_flags_peaks_and_mishaps_are_asked_of_every_flight(name):
    never = ("completed", "survived_s", "detached", "bounces", "reduced_said")
    for criterion in experiment(name).every_criterion():
        assert criterion.every or not (criterion.metric in never or "peak" in criterion.metric), criterion.text


def test_a_crash_is_no_good_figure():
    verdict = judged([0.1, 0.2], [True, False], at_most=0.5)
    assert not verdict.met and (verdict.within, verdict.median, verdict.known) == (1, 0.1, 1)
    assert judged([0.1, 0.1], [True, False], at_most=0.5, include_failed=True).met


def test_two_tables_compare_flight_by_flight(tmp_path):
    for name, shift in (("a", 0.0), ("b", 1.0)):
        write_table(tmp_path / name / "x.parquet", table({"qp": [1.0 + shift, 5.0 + shift, 9.0 + shift]}, push=5.0))
    cell = compare(read_run(tmp_path / "a"), read_run(tmp_path / "b"))[0]
    found = next(iter(cell["differences"].values()))
    assert (cell["n"], found["a"], found["b"], found["median"]) == (3, 5.0, 6.0, 1.0)
    assert math.isnan(found["sure_low"])  # three pairs are too few


def test_two_paint_runs_compare_law_by_law_whatever_their_seeds(tmp_path):
    for name, seed, path in (("a", 0, 0.001), ("b", 7, 0.003)):
        metrics = {"completed": True, "reason": "done", "path_rms_straight_m": path, "outcomes": {}, "rows": []}
        content = {"seed": seed, "version": "1", "laws": {"qp": metrics, "paper": metrics}}
        (tmp_path / name).mkdir()
        (tmp_path / name / "summary.json").write_text(json.dumps(content))
    compared = compare(read_run(tmp_path / "a"), read_run(tmp_path / "b"))
    assert [cell["law"] for cell in compared] == ["qp", "paper"]
    assert compared[0]["differences"]["path_rms_straight_m"]["median"] == pytest.approx(0.002)


def test_runs_that_share_nothing_are_refused(tmp_path):
    for name, push in (("a", 5.0), ("b", 6.0)):
        write_table(tmp_path / name / "x.parquet", table({"qp": [1.0]}, push=push))
    with pytest.raises(ConfigError, match="share no flight"):
        compare(read_run(tmp_path / "a"), read_run(tmp_path / "b"))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_experiment_pairs_its_laws_and_judges_figures_that_its_cells_can_have(name):
    each = experiment(name)
    for quick in (True, False):
        flights = designs(name, Choice(quick=quick))
        keys = [(run.variant, str(run.params), run.law, run.seed) for run in flights]
        assert len(set(keys)) == len(keys)
        assert {run.experiment for run in flights} == {name}
        assert {key for run in flights for key in run.params} == set(each.params)
        standard = [run for run in flights if run.variant == "standard" and run.params.get("kind") != "map"]
        laws = {"qp"} if name == "rivals" else {"qp", "paper"}  # rivals are compared with the program
        assert {run.law for run in standard} == laws
        seeds = {law: sorted(str(run.params) + str(run.seed) for run in standard if run.law == law) for law in laws}
        assert all(each == seeds["qp"] for each in seeds.values())
