"""Goals of the law: their flights and figures exist, and the comparison pairs flights by seed."""

from __future__ import annotations

import math
from dataclasses import replace

import polars as pl
import pytest

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import load_toml
from sim.evaluate.figures import figure_of
from sim.experiments.design import Choice, design
from sim.experiments.goals.__main__ import HERE, SETS
from sim.experiments.goals.goal import Goal, Goals, flights_of, outcome
from sim.experiments.spec import Experiment

BEFORE = pl.read_csv(HERE / "law" / "before.csv")
GOALS = {name: load_toml(Goals, HERE / name / "goals.toml").goals for name in SETS}
RUNS = {
    name: design(load_toml(Experiment, HERE / name / "flights.toml"), Choice(features="geometric")) for name in SETS
}


@pytest.mark.parametrize("name", SETS)
def test_every_goal_has_flights_and_those_of_its_reference(name: str) -> None:
    for goal in GOALS[name]:
        flights = flights_of(goal, RUNS[name])
        seeds = {run.seed for run in flights}
        assert len(flights) >= 10 and figure_of(goal.figure).words
        old = BEFORE.filter((pl.col("kind") == goal.kind) & (pl.col("world") == goal.world))
        if goal.against:
            assert {run.seed for run in flights_of(replace(goal, kind=goal.against), RUNS[name])} >= seeds, goal
        elif goal.ratio_at_most is not None:
            assert set(old["seed"]) == seeds and old[goal.figure].null_count() == 0, goal


def flown(factor: float) -> pl.DataFrame:
    """Flights with this multiple of the path error of before."""
    old = BEFORE.filter((pl.col("kind") == "paint") & (pl.col("world") == "harsh"))
    return old.select(
        pl.col("kind").alias("param.kind"),
        pl.col("world").alias("param.world"),
        "seed",
        pl.lit(True).alias("completed"),
        pl.col("path_rms_straight_m") * factor,
    )


def test_a_ratio_is_that_of_flights_with_the_same_seed() -> None:
    goal = Goal(kind="paint", world="harsh", figure="path_rms_straight_m", ratio_at_most=0.8)
    for factor, met in ((0.7, True), (0.9, False)):
        found = outcome(goal, flown(factor).sample(fraction=1.0, shuffle=True, seed=1), BEFORE, 10)
        assert found.ratio == pytest.approx(factor) and found.interval == pytest.approx((factor, factor))
        assert found.n == 10 and found.met is met and found.cells[-1] == ("yes" if met else "NO")


def test_a_flight_that_is_missing_or_failed_meets_nothing() -> None:
    goal = Goal(kind="paint", world="harsh", figure="path_rms_straight_m", ratio_at_most=0.8)
    good = flown(0.7)
    failed = good.with_columns(pl.when(pl.col("seed") == 3).then(False).otherwise(True).alias("completed"))
    empty = good.with_columns(pl.when(pl.col("seed") > 0).then(pl.col(goal.figure)).alias(goal.figure))
    for flights in (good.head(1), failed, empty):
        found = outcome(goal, flights, BEFORE, 10)
        assert not found.met and found.n < 10 and found.ratio == pytest.approx(0.7)


def test_without_flights_no_goal_is_met() -> None:
    for goal in GOALS["law"]:
        found = outcome(goal, pl.DataFrame(), BEFORE, 10)
        assert found.n == 0 and math.isnan(found.now) and not found.met and "–" in found.cells


@pytest.mark.parametrize(("bound", "met"), [(0.9, True), (0.95, False)])
def test_a_share_is_that_of_all_flights(bound: float, met: bool) -> None:
    goal = Goal(kind="paint", world="harsh", figure="completed", of="mean", at_least=bound)
    flights = flown(0.7).with_columns((pl.col("seed") != 3).alias("completed"))
    found = outcome(goal, flights, BEFORE, 10)
    assert found.now == pytest.approx(0.9) and found.n == 10 and found.met is met


def test_the_worst_flight_counts_completed_or_not() -> None:
    goal = Goal(kind="paint", world="harsh", figure="path_rms_straight_m", of="largest", at_most=0.001)
    flights = flown(0.7).with_columns(pl.lit(False).alias("completed"))
    found = outcome(goal, flights, BEFORE, 10)
    assert found.now == flights[goal.figure].max() and found.n == 10 and not found.met


def test_a_goal_states_one_bound() -> None:
    with pytest.raises(ConfigError, match="state one of"):
        Goal(kind="paint", world="harsh", figure="path_rms_m", at_most=1.0, ratio_at_most=1.0)
    with pytest.raises(ConfigError, match="that of the median"):
        Goal(kind="paint", world="harsh", figure="path_rms_m", of="mean", ratio_at_most=1.0)
    with pytest.raises(ConfigError, match="upper bound"):
        Goal(kind="paint", world="harsh", figure="path_rms_m", of="largest", at_least=1.0)
