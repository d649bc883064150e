"""Record of laws and gains: mixed model, comparisons, figures that move together, and the page from its template."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from sim.experiments import FAIR
from sim.experiments.comparison import Comparison, Outcome, grouped, opponent_name
from sim.experiments.comparison import comparisons as of_experiment
from sim.experiments.design import Choice, design
from sim.experiments.fair.__main__ import page, put_into
from sim.experiments.page import QP, Fields
from sim.experiments.spec import experiment
from sim.rivals import MPC
from sim.sweep.parts import read_tables
from sim.sweep.statistics import CROSSED, law_and_gains

ROOT = Path(__file__).parents[3]

CELLS = (("paint", "datasheet", 0.1), ("slide at the reach", "ideal", 12.6))
LAWS = (*CROSSED, ("paper", "box"), ("qp", "mpc"))


def comparisons(table: pl.DataFrame) -> list[Comparison]:
    return of_experiment(experiment(FAIR), table)


def flights(law_effect: float, gain_effect: float) -> pl.DataFrame:
    """Flights whose figures are those of the QP times the effects of law and gains."""
    rng, rows = np.random.default_rng(0), []
    for kind, world, level in CELLS:
        base = rng.normal(0.0, 0.5)
        for seed in range(10):
            place = rng.normal(0.0, 0.2)
            for law, variant in LAWS:
                one, other = CROSSED.get((law, variant), (0.5, 0.5))
                size = float(np.exp(base + place + law_effect * one + gain_effect * other + rng.normal(0.0, 0.02)))
                figures = {"path_rms_m": 0.002 * size, "path_rms_straight_m": 0.002 * size, "force_rms_n": 0.2}
                rows.append(
                    {"experiment": FAIR, "law": law, "variant": variant, "seed": seed, "completed": True}
                    | {"param.kind": kind, "param.world": world, "param.level": level}
                    | {
                        "slide_held": None if kind == "paint" else float(law == "qp"),
                        "tilt_peak_deg": 1.0,
                        "yaw_peak_deg": 0.5,
                        **figures,
                    }
                )
    return pl.DataFrame(rows)


def test_the_mixed_model_separates_law_and_gains():
    found = law_and_gains(flights(0.3, -0.1), "path_rms_m")
    for name, effect in (("law", 0.3), ("gains", -0.1), ("interaction", 0.0)):
        assert found[name].low <= np.exp(effect) <= found[name].high, name
        assert found[name].ratio == pytest.approx(np.exp(effect), rel=0.03)


def test_a_larger_error_of_the_opponent_is_a_win_and_the_group_counts_once():
    found, analytic = comparisons(flights(0.8, 0.0)), opponent_name("paper", "standard")
    opponents = {opponent_name(*law) for law in LAWS if law != QP}
    assert {each.opponent for each in found} == opponents
    path = [each for each in found if each.metric.startswith("path") and each.opponent == analytic]
    assert len(path) == 4 and {each.outcome for each in path} == {Outcome.WON}
    groups = {key: value for key, value in grouped(found).items() if key[0] == analytic and key[2] == "path"}
    assert list(groups.values()) == [{Outcome.WON}, {Outcome.WON}]
    lost, gains = grouped(comparisons(flights(-0.8, 0.0))), opponent_name("qp", "exchanged-gains")
    assert {value for key, value in lost.items() if key[2] == "path" and key[0] != gains} == {frozenset({Outcome.LOST})}


def test_a_group_that_is_better_and_worse_counts_as_both():
    table = flights(0.8, 0.0).with_columns(path_rms_straight_m=1e-5 / pl.col("path_rms_m"))
    groups = grouped(comparisons(table))
    both = {value for key, value in groups.items() if key[0] == opponent_name("paper", "standard") and key[2] == "path"}
    assert both == {frozenset({Outcome.WON, Outcome.LOST})}


def test_flights_that_both_laws_complete_are_no_difference():
    groups = grouped(comparisons(flights(0.0, 0.0)))
    assert {value for key, value in groups.items() if key[2] == "completed"} == {frozenset({Outcome.NEITHER})}


def test_the_page_has_every_number_from_the_table():
    table = flights(0.8, 0.0)
    text, fields = page(table), Fields(experiment(FAIR), table)
    assert f"{table.height} flights" in text and "{{" not in text
    assert "| analytic law, box | 3 |" in text  # the paths of both cells, and the slide
    assert (
        "| paint 0.1, datasheet |" in text
        and "| 10 of 10 |" in text
        and "held 10 of 10" in text
        and "held 0 of 10" in text
    )
    cell = {"kind": "paint", "world": "datasheet", "level": 0.1}
    assert fields.median("path_rms_m", "qp", **cell).endswith(" mm")
    assert fields.gap("path_rms_m", "paper", **cell).startswith("+")
    assert str(fields.mixed("path_rms_m")["law"]) in text


@pytest.mark.slow
def test_every_cell_crosses_laws_and_gains_with_the_same_seeds():
    cells: dict[str, dict[tuple[str, str], list[int]]] = {}
    for run in design(experiment(FAIR), Choice(compiled=True)):
        cells.setdefault(str(run.params), {}).setdefault((run.law, run.variant), []).append(run.seed)
        assert (run.plan.options.controller == MPC) is (run.variant == "mpc")
    assert len(cells) == 24
    for flown in cells.values():
        assert set(CROSSED) | {("paper", "box"), ("qp", "mpc")} <= set(flown)
        assert all(seeds == list(range(10)) for seeds in flown.values())


def test_the_shipped_page_and_readme_have_the_numbers_of_the_shipped_table() -> None:
    record = read_tables([ROOT / "docs" / "experiments" / "fair.parquet"])
    assert (ROOT / "docs" / "experiments" / "results.md").read_text(encoding="utf-8") == page(record)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert put_into(readme, record) == readme
