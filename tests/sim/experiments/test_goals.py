"""Goals: their flights and references exist, and a ratio pairs flights by seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

import sim.experiments
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import load_toml
from sim.experiments.criteria import EVERY, Bound, Criterion
from sim.experiments.design import Choice, design
from sim.experiments.spec import Experiment
from sim.experiments.verdict import GOALS, evaluate, verdicts

SETS = sorted(file.stem for file in Path(sim.experiments.__file__).parent.glob("goals/*.toml"))
CRITERION = Criterion(text="path", metric="path_rms_m", ratio_at_most=0.8, before="before.csv")


@pytest.mark.parametrize("name", SETS)
def test_every_goal_has_flights_and_those_of_its_reference(name: str) -> None:
    spec = load_toml(Experiment, GOALS / f"{name}.toml")
    flown: dict[tuple, set[int]] = {}
    for run in design(spec, Choice(features="geometric")):
        flown.setdefault((run.law, tuple(sorted(run.params.items()))), set()).add(run.seed)
    before = pl.read_csv(GOALS / "before.csv")
    for goal in spec.every_criterion():
        cells = {
            key: seeds for key, seeds in flown.items() if key[0] == goal.law and set(goal.where.items()) <= set(key[1])
        }
        assert cells and min(len(seeds) for seeds in cells.values()) >= 5
        for (law, params), seeds in cells.items():
            if goal.against:
                assert flown[law, tuple(sorted((dict(params) | goal.against).items()))] >= seeds
            elif goal.before:
                same = [pl.col(f"param.{key}") == value for key, value in params]
                assert set(before.filter(*same).drop_nulls(goal.metric)["seed"]) >= seeds


def flights(kind: str, values: list[float | None], completed: bool = True) -> pl.DataFrame:
    facts = {"experiment": "goals", "law": "qp", "variant": "standard", "param.kind": kind, "completed": completed}
    rows = [facts | {"seed": seed, "path_rms_m": value} for seed, value in enumerate(values)]
    return pl.DataFrame(rows, schema_overrides={"path_rms_m": pl.Float64})


@pytest.mark.parametrize(("factor", "met"), [(0.7, True), (0.9, False)])
def test_a_ratio_is_that_of_flights_with_the_same_seed(factor: float, met: bool) -> None:
    old = flights("flat", [0.001 * (seed + 1) for seed in range(10)])
    new = old.with_columns(pl.col("path_rms_m") * factor).sample(fraction=1.0, shuffle=True, seed=1)
    found = evaluate(CRITERION, {}, new, {}, old)
    assert (found.median, found.worst) == pytest.approx((factor, factor)) and found.met is met


def test_a_flight_that_is_missing_or_failed_meets_nothing() -> None:
    old, good = flights("flat", [0.002] * 10), flights("lean", [0.001] * 10)
    for new, reference in (
        (flights("lean", [0.001] * 10, completed=False), old),
        (flights("lean", [None] + [0.001] * 9), old),
        (good, old.head(9)),
    ):
        assert not evaluate(CRITERION, {}, new, {}, reference).met
    assert evaluate(CRITERION, {}, good, {}, old).met


def test_reference_flights_are_those_of_the_same_law_and_other_parameters() -> None:
    spec = load_toml(Experiment, GOALS / "surfaces.toml")
    table = pl.concat((flights("flat", [0.002] * 10), flights("lean 10", [0.004] * 10)))
    (found,) = [each for each in verdicts(spec, table) if each.criterion.metric == "path_rms_m" and each.n]
    assert found.median == pytest.approx(2.0) and not found.met and not np.isnan(found.bound)


def test_a_goal_states_one_bound_and_a_ratio_its_reference() -> None:
    for refused, words in (
        ({"at_most": 1.0, "ratio_at_most": 1.0}, "needs one of"),
        ({"ratio_at_most": 1.0}, "either against or before"),
        ({"ratio_at_most": 1.0, "before": "before.csv", "statistic": EVERY}, "ratio of medians"),
    ):
        with pytest.raises(ConfigError, match=words):
            Bound(text="path", metric="path_rms_m", **refused)
