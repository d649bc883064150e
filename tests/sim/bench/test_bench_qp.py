"""`ibvs-qp bench qp` on few ticks: the contract's names, counts, and ticks of closed loops."""

from __future__ import annotations

import json

import numpy as np
import pytest

from sim.bench.ticks import recorded_ticks
from sim.commands.cli import main


def test_ticks_are_those_of_a_flight() -> None:
    ticks = recorded_ticks(1500, seed=0)
    stamps = np.array([measurement.stamp_ns for measurement, _ in ticks])
    assert len(ticks) == 1500 and (np.diff(stamps) == 4_000_000).all()
    assert any(measurement.lines for measurement, _ in ticks)


def test_bench_qp_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "qp", "--ticks", "1200", "--sample", "60", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    rows = {row["name"]: row for row in table["rows"]}
    assert table["schema"] == 1 and {
        "step",
        "step_interpreted",
        "qpsolvers_osqp",
        "qpsolvers_assembly",
        "casadi_daqp",
    } <= set(rows)
    assert set(rows["step"]) == {"name", "size", "p50_us", "p90_us", "p99_us", "p999_us", "max_us", "misses"}
    assert set(table["stages_us"]) == {"pack", "evaluate", "solve", "explain"}
    assert table["ratios"]["qpsolvers_osqp"] > 1.0
    assert rows["qpsolvers_assembly"]["p50_us"] < rows["qpsolvers_osqp"]["p50_us"]
    kinds = [*table["row_kinds"], "step_interpreted", "mink_12_joints"]
    assert all(any(name == kind or name.startswith(kind.removesuffix("NAME")) for kind in kinds) for name in rows)
    assert sum(table["outcomes"].values()) == table["ticks"] == 1200
    assert table["osqp_iterates_share"] == 1.0 and "0" not in table["iterations"]
    assert table["difference_to_exact_n"]["max"] < 2e-2
    assert table["difference_to_exact_unlimited_n"]["max"] < 1e-3


@pytest.mark.parametrize("words", [["--ticks", "5"], ["--sample", "0"]])
def test_bench_qp_refuses_nonsense_in_one_line(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "qp", *words]) == 2
    said = capsys.readouterr().err
    assert words[0] in said and said.count("\n") == 1
