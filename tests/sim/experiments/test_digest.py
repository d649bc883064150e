"""The README's table of results: from the data beside the results page, to the letter."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from sim.experiments.digest import BEGIN, END, LINES, Line, digest, put_into
from sim.experiments.spec import Column, experiment

#: Longest README, and longest table in it [lines].
MOST_LINES, MOST_ROWS = 150, 12
ROOT = Path(__file__).parents[3]
ROW = {"experiment": "paint", "variant": "standard", "seed": 0, "param.push_n": 5.0}


def table(*rows: dict) -> pl.DataFrame:
    return pl.DataFrame(
        [ROW | {"law": "qp", "completed": True, "path_rms_m": None} | row for row in rows], strict=False
    )


LINE = Line(label="error [mm]", experiment="paint", metric="path_rms_m", where={"push_n": 5.0})


def test_the_readme_shows_what_the_data_say() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    data = pl.read_parquet(ROOT / "docs" / "experiments" / "all.parquet")
    assert text == put_into(text, digest(data))
    assert text.count("\n") < MOST_LINES and len(LINES) <= MOST_ROWS
    assert digest(data).count("\n") > 2


def test_medians_of_flights_that_ended_as_planned_and_how_many_did_not() -> None:
    rows = [{"path_rms_m": value} for value in (0.001, 0.002, 0.009)] + [{"completed": False, "path_rms_m": 9.0}]
    rows += [
        {"law": "paper", "completed": False},
        {"path_rms_m": 7.0, "param.push_n": 6.0},
        {"variant": "x", "path_rms_m": 8.0},
    ]
    assert digest(table(*rows), [LINE]).splitlines()[2] == (
        "| error [mm] | 2.00 (1.00 to 9.00); fails in 1 of 4 | fails in 1 of 1 | – | – | 4 | paint |"
    )


@pytest.mark.parametrize(
    ("clip", "box", "best"),
    [(0.002, 0.001, "box: 1.00"), (0.001, 0.002, "clip"), (None, 0.009, "box: 9.00"), (0.001, None, "clip")],
)
def test_the_best_allocator_of_the_analytic_law_stands_beside_the_shipped_one(clip, box, best) -> None:
    rows: list[dict] = [{"path_rms_m": 0.001}]
    for variant, error in (("standard", clip), ("box", box)):
        rows.append({"law": "paper", "variant": variant, "completed": error is not None, "path_rms_m": error})
    assert digest(table(*rows), [LINE]).splitlines()[2].split(" | ")[3] == best


def test_survivors_are_counted_over_all_flights_and_further_metrics_follow() -> None:
    rows = table(
        {"path_rms_m": 5.0, "tilt_rms_deg": 1.25},
        {"path_rms_m": 3.0, "completed": False},
        {"law": "paper", "path_rms_m": 3.0},
        {"law": "paper", "variant": "box", "path_rms_m": 6.0},
    )
    lives = Line(label="alive", experiment="paint", metric="path_rms_m", at_least=5.0)
    also = Line(
        label="push",
        experiment="paint",
        metric="path_rms_m",
        also=(Column(metric="tilt_rms_deg", label="tilt {} deg", digits=1),),
    )
    lines = [line.split(" | ") for line in digest(rows, [lives, also]).splitlines()[2:]]
    assert lines[0][1:4] == ["1 of 2", "0 of 1", "box: 1 of 1"]
    assert lines[1][1] == "5000.00; tilt 1.2 deg; fails in 1 of 2"


def test_lines_without_flights_are_left_out() -> None:
    assert digest(table({"experiment": "gust"}), [LINE]).count("\n") == 2


def test_only_what_stands_between_the_marks_is_replaced() -> None:
    assert put_into(f"a {BEGIN} old {END} b", "new\n") == f"a {BEGIN}\nnew\n{END} b"
    with pytest.raises(ValueError):
        put_into("no marks", "new\n")


@pytest.mark.parametrize("line", LINES, ids=[line.label for line in LINES])
def test_every_line_selects_flights_of_the_record(line: Line) -> None:
    spec = experiment(line.experiment)
    assert any(
        all(value in flights.levels.get(name, ()) for name, value in line.where.items())
        and line.variant in flights.levels.get("variant", ("standard",))
        for flights in spec.flights
    )
    if line.metric != "completed":
        assert line.metric in {column.metric for column in spec.columns}
