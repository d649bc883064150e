"""The table of a flight fits a terminal of 80 columns, and every number of it is whole."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from synthetic_trace import Errors, synthetic_trace

from sim.evaluate.flight_table import LINES, figure_table
from sim.evaluate.metrics import compute_metrics
from sim.world.scene import PaintScene, Scene


@pytest.mark.parametrize("laws", [("qp",), ("qp", "paper")])
def test_the_table_fits_80_columns_and_cuts_no_number(laws):
    scene = Scene(paint=PaintScene(rows=4))
    metrics = {law: compute_metrics(synthetic_trace(Errors(row_offset_m=(0.01, -0.05, 0.03, -0.06)), scene, law))
               for law in laws}  # fmt: skip
    for figures in metrics.values():
        figures |= {"first_touch_s": 12345.678, "force_peak_n": -1234567.891, "reason": "supercalifragilistic" * 4}
    Console(file=(text := io.StringIO()), width=80).print(figure_table(metrics))
    lines = text.getvalue().splitlines()
    assert max(map(len, lines)) <= 80 and "…" not in text.getvalue()
    words = text.getvalue().split()
    for figure in LINES:
        for figures in metrics.values():
            shown = figure.show(figures)
            if any(map(str.isdigit, shown)) and " " not in shown:
                assert shown in words or figure.name == "reason", figure.name
        assert any(line.strip().startswith(figure.words) for line in lines), figure.words
    assert "CLAIM)" in words and "row 3" in " ".join(words)
