"""The README's table of results: from the data beside the results page, to the letter."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from sim.experiments.digest import BEGIN, END, LINES, Line, digest, put_into
from sim.experiments.spec import Column

ROOT = Path(__file__).parents[3]
ROW = {"experiment": "paint", "variant": "standard", "seed": 0, "param.push_n": 5.0}


def table(*rows: dict) -> pl.DataFrame:
    return pl.DataFrame([ROW | {"law": "qp", "completed": True, "error_m": None} | row for row in rows], strict=False)


LINE = Line(label="error [mm]", experiment="paint", metric="error_m", scale=1e3, where={"push_n": 5.0})


def test_the_readme_shows_what_the_data_say() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    data = pl.read_parquet(ROOT / "docs" / "experiments" / "all.parquet")
    assert text == put_into(text, digest(data))
    assert digest(data).count("\n") == len(LINES) + 2


def test_medians_of_flights_that_ended_as_planned_and_how_many_did_not() -> None:
    rows = [{"error_m": value} for value in (0.001, 0.002, 0.009)] + [{"completed": False, "error_m": 9.0}]
    rows += [
        {"law": "paper", "completed": False},
        {"error_m": 7.0, "param.push_n": 6.0},
        {"variant": "x", "error_m": 8.0},
    ]
    assert digest(table(*rows), [LINE]).splitlines()[2] == (
        "| error [mm] | 2.00 (1.00 to 9.00); fails in 1 of 4 | fails in 1 of 1 | – | 4, 1 | `experiment paint` |"
    )


def test_who_lives_is_counted_over_all_flights_and_what_else_is_kept_stands_behind() -> None:
    rows = table({"error_m": 5.0, "tilt": 1.25}, {"error_m": 3.0, "completed": False})
    lives = Line(label="alive", experiment="paint", metric="error_m", at_least=5.0)
    also = Line(
        label="push", experiment="paint", metric="error_m", also=(Column(metric="tilt", label="tilt {} deg", digits=1),)
    )
    assert [line.split(" | ")[1] for line in digest(rows, [lives, also]).splitlines()[2:]] == [
        "1 of 2",
        "5.00; tilt 1.2 deg; fails in 1 of 2",
    ]


def test_lines_without_flights_are_left_out() -> None:
    assert digest(table({"experiment": "gust"}), [LINE]).count("\n") == 2


def test_only_what_stands_between_the_marks_is_replaced() -> None:
    assert put_into(f"a {BEGIN} old {END} b", "new\n") == f"a {BEGIN}\nnew\n{END} b"
    with pytest.raises(ValueError):
        put_into("no marks", "new\n")
