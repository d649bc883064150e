"""Comparisons of the QP with its opponents: who flies which cell, and what counts as lost."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import polars as pl
import pytest

from sim.experiments.comparison import Comparison, Outcome
from sim.experiments.losses.__main__ import main, step_times
from sim.experiments.losses.comparison import comparisons
from sim.experiments.losses.flights import COMPARED, LIMITED, base_of, runs_of
from sim.rivals import MPC

#: A row of the page: an opponent and four counts.
_COUNTED = re.compile(r"\|[^|]+(\| \d+ ){4}\|$")
CELL = {"experiment": "friction", "param.world": "ideal", "param.friction": 0.8}


def rows(law: str, variant: str, values: list[float], completed: list[bool] | None = None) -> pl.DataFrame:
    """Flights of a cell with these push errors [N]."""
    table = {"seed": range(len(values)), "completed": completed or [True] * len(values), "force_rms_n": values}
    return (
        pl.DataFrame(table)
        .with_columns(*(pl.lit(value).alias(name) for name, value in CELL.items()))
        .with_columns(pl.lit(law).alias("law"), pl.lit(variant).alias("variant"))
    )


def compared(**theirs: Any) -> dict[str, Comparison]:
    """Comparisons of ten flights of the QP, of 0.1 to 0.19 N, with the box-constrained analytic law, by figure."""
    mine = rows("qp", "standard", [0.1 + 0.01 * seed for seed in range(10)], theirs.pop("mine", None))
    found = comparisons(pl.concat((mine, rows("paper", "box", **theirs))))
    assert all(each.opponent == "analytic law, box" for each in found)
    return {each.words.split(",")[0]: each for each in found}


@pytest.mark.slow
@pytest.mark.parametrize("name", COMPARED)
def test_every_opponent_flies_every_cell_of_the_qp_with_its_seeds(name: str) -> None:
    flown: dict[tuple[str, str], dict[tuple[str, str], set[int]]] = {}
    for run in runs_of((name,)):
        assert run.plan.options.features == "geometric"
        cell = flown.setdefault((str(run.params), base_of(run.variant)), {})
        cell.setdefault((run.law, run.variant), set()).add(run.seed)
    assert flown
    for (_, base), laws in flown.items():
        prefix = "" if base == "standard" else f"{base}-"
        allocators = {("paper", f"{prefix}{each}") for each in ("sequential", "box")} if name in LIMITED else set()
        opponents = {("paper", base), ("paper", f"{prefix}shared-gains"), ("qp", f"{prefix}mpc")} | allocators
        assert set(laws) == {("qp", base)} | opponents
        assert len({frozenset(seeds) for seeds in laws.values()}) == 1 and len(laws["qp", base]) == 10


def test_the_rival_flies_the_rival_and_the_reach_check_is_off_where_named() -> None:
    for run in runs_of(("saturation",)):
        assert (run.plan.options.controller == MPC) is run.variant.endswith("mpc")
        assert run.plan.config.controller.reach_check is not run.variant.startswith("no-reach-check")


def test_a_comparison_is_lost_when_the_whole_interval_is_worse_than_what_matters() -> None:
    least = compared(values=[0.1] * 10)["push error"].least
    outcomes = ((1.2, Outcome.LOST), (0.8, Outcome.NEITHER), (-0.8, Outcome.NEITHER), (-1.2, Outcome.WON))
    for factor, outcome in outcomes:
        better = factor * least
        found = compared(values=[0.1 + 0.01 * seed - better for seed in range(10)])["push error"]
        assert found.worse == pytest.approx(better) and found.pairs == 10
        assert found.outcome is outcome


def test_an_opponent_that_flies_like_another_one_is_counted_once() -> None:
    """Both laws share all gains but three, so "shared-gains" often is "standard" again."""
    same = [0.1] * 10
    flights = [rows("qp", "standard", [0.3] * 10), rows("paper", "standard", same), rows("paper", "shared-gains", same)]
    opponents = {each.opponent for each in comparisons(pl.concat(flights))}
    assert opponents == {"analytic law, standard"}
    flights[2] = rows("paper", "shared-gains", [*same[:9], 0.1001])
    assert len({each.opponent for each in comparisons(pl.concat(flights))}) == 2


def test_one_bad_seed_of_ten_decides_nothing() -> None:
    values = [0.1 + 0.01 * seed for seed in range(10)]
    assert compared(values=[values[0] - 5.0, *values[1:]])["push error"].outcome is Outcome.NEITHER


def test_a_figure_of_which_more_is_better_is_worse_when_it_is_less() -> None:
    """Contact of 90 % against 99 %: in the unit of the table."""
    flights = [
        rows(law, "standard", [0.1] * 10).with_columns(pl.lit(share).alias("contact_share"))
        for law, share in (("qp", 0.90), ("paper", 0.99))
    ]
    found = {each.words: each for each in comparisons(pl.concat(flights))}["contact while painting, %"]
    assert found.worse == pytest.approx(9.0) and found.outcome is Outcome.LOST


@pytest.mark.parametrize(("failed", "outcome"), [(5, Outcome.FEW), (6, Outcome.LOST)])
def test_flights_that_only_the_opponent_completes_are_lost(failed: int, outcome: Outcome) -> None:
    found = compared(values=[0.1] * 10, mine=[seed >= failed for seed in range(10)])
    assert found["flights completed by one law alone"].outcome is outcome
    assert found["flights completed by one law alone"].pairs == failed


def test_a_saved_table_prints_the_same_comparisons(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    flown = pl.concat((rows("qp", "standard", [0.9] * 10), rows("paper", "box", [0.1] * 10)))
    flown = flown.with_columns(pl.lit("landed").alias("reason"))
    monkeypatch.setattr("sim.experiments.losses.__main__.fly_part", lambda *_: (flown, False))
    printed = []
    for options in (["--save", str(tmp_path / "kept.parquet")], ["--table", str(tmp_path / "kept.parquet")]):
        monkeypatch.setattr("sys.argv", ["losses", "friction", *options])
        assert main() == 1
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1]
    assert "1 of 2 comparisons lost" in printed[0] and "; 20 of" in printed[0]


def test_the_times_are_those_of_every_law_in_its_own_slide(monkeypatch: pytest.MonkeyPatch) -> None:
    flown = []

    def fly(scene: object, options: Any, **_: object) -> SimpleNamespace:
        flown.append((options.law, options.controller, options.seed))
        return SimpleNamespace(step_us=[len(flown), 100.0 * len(flown), 1e6])

    monkeypatch.setattr("sim.experiments.losses.__main__.fly", fly)
    names = [("paper", name) for name in ("box", "sequential", "shared-gains", "standard")]
    names += [("qp", "mpc"), ("qp", "standard")]
    assert step_times() == [(*name, f"{100 * (place + 1)}") for place, name in enumerate(names)]
    assert [(law, rival) for law, rival, _ in flown] == [("paper", "")] * 4 + [("qp", MPC), ("qp", "")]
    assert len({seed for *_, seed in flown}) == 1


@pytest.mark.slow
def test_the_page_counts_what_the_table_of_flights_has() -> None:
    folder = Path(__file__).parents[3] / "docs/experiments"
    found = comparisons(pl.read_parquet(folder / "losses.parquet"))
    page = (folder / "comparisons.md").read_text(encoding="utf-8")
    lost = [each for each in found if each.outcome is Outcome.LOST]
    assert f"{len(lost)} of {len(found):,} are lost" in page
    outcomes = Counter((each.opponent, each.outcome) for each in found)
    rows = {tuple(int(cell) for cell in line.split("|")[2:6]) for line in page.splitlines() if _COUNTED.match(line)}
    assert rows == {tuple(outcomes[name, each] for each in Outcome) for name, _ in outcomes}
    headings = [line for line in page.splitlines() if line.startswith("## ") and " lost" in line]
    words = ("beyond the reach", "rotor", "thrust rate", "touch")
    counts = [sum(_mechanism(each) == word for each in lost) for word in words]
    assert [int(heading.split(": ")[1].split()[0]) for heading in headings] == counts


def _mechanism(lost: Comparison) -> str:
    if "no-reach-check" in lost.opponent:
        return "beyond the reach"
    if "rotor lost" in lost.params.values() or "loss" in lost.params.values():
        return "rotor"
    return "thrust rate" if "thrust rate" in lost.words else "touch"
