"""The table of the README: a dozen figures of both laws, from the tables of a full run, none typed.

``python -m sim.experiments.digest docs/experiments/all.parquet README.md`` renews it.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.rotor_derate import DESCEND_S
from sim.experiments.wording import rounded
from sim.sweep.parts import PARAM
from sim.sweep.statistics import median_interval

#: What surrounds the table in a text.
BEGIN, END = "<!-- experiments: generated -->", "<!-- end of experiments -->"


@dataclass(frozen=True, kw_only=True)
class Line:
    """A row: one figure over the flights of both laws that match.

    Attributes:
        words: What is measured, with its unit.
        experiment: Where.
        metric: Figure.
        scale: From SI to the unit shown.
        digits: Decimals.
        variant: Of the controller.
        params: Parameters of the cells; others vary.
        published: What the literature reports of it.
        also: Further figures shown behind it: metric, words with "{}" for the number, scale, decimals.
        at_least: Counts the flights, failed ones too, that reach this value instead of showing a median.
    """

    words: str
    experiment: str
    metric: str
    scale: float = 1.0
    digits: int = 2
    variant: str = "standard"
    params: dict[str, Any] = field(default_factory=dict)
    published: str = "–"
    also: tuple[tuple[str, str, float, int], ...] = ()
    at_least: float | None = None


#: What a press keeps of height and attitude.
_KEPT = (("height_error_peak_m", "height off by {} mm", 1e3, 1), ("tilt_peak_deg", "tilt {} deg, peaks", 1.0, 2))
_BEYOND = {"kind": "static", "push_n": 35.0, "friction": 0.3}


LINES = (
    Line(
        words="path on straights, rms [mm]",
        experiment="paint",
        metric="path_rms_straight_m",
        scale=1e3,
        published="plots only; another vehicle of this class flew 29 mm",
    ),
    Line(words="path in corners, rms [mm]", experiment="paint", metric="path_rms_corner_m", scale=1e3),
    Line(
        words="push error on straights, rms, of 5 N [N]",
        experiment="paint",
        metric="force_rms_straight_n",
        digits=3,
        published="plots only; another vehicle 0.7 N",
    ),
    Line(words="roll and pitch, rms [deg]", experiment="paint", metric="tilt_rms_deg"),
    Line(
        words="push within 0.5 N, from first touch [s]",
        experiment="force-hold",
        metric="settle_s",
        params={"kind": "hold", "stiffness_n_m": 1500.0},
        published="about 10 s (20 to 30 s of its plot)",
    ),
    Line(
        words="path in the heaviest noise, rms [mm]",
        experiment="noise-sweep",
        metric="path_rms_m",
        scale=1e3,
        digits=1,
        params={"sigma_vs": 0.12, "sigma_f_n": 3.0},
        published="flown; within the sensors' noise",
    ),
    Line(
        words="push error there, rms [N]",
        experiment="noise-sweep",
        metric="force_rms_n",
        params={"sigma_vs": 0.12, "sigma_f_n": 3.0},
    ),
    Line(
        words="35 N asked of 30.4 N reach, unchecked: push [N]",
        experiment="saturation",
        metric="push_mean_n",
        digits=1,
        variant="no-reach-check",
        params=_BEYOND,
        also=_KEPT,
    ),
    Line(
        words="the QP's thrusts clipped afterwards instead: push [N]",
        experiment="saturation",
        metric="push_mean_n",
        digits=1,
        variant="clipped",
        params=_BEYOND,
        also=_KEPT,
    ),
    Line(
        words="yaw, peak, sliding at friction 0.8 [deg]",
        experiment="friction",
        metric="yaw_peak_deg",
        params={"friction": 0.8},
    ),
    Line(
        words="push error in gusts of 2 N, rms [N]",
        experiment="gust",
        metric="force_rms_n",
        params={"kind": "gust", "wind": 2.0},
    ),
    Line(
        words=f"alive {DESCEND_S:g} s after a rotor is lost while pressing, of flights",
        experiment="rotor-derate",
        metric="survived_s",
        params={"kind": "loss"},
        at_least=DESCEND_S,
    ),
)


def digest(table: pl.DataFrame, lines: Sequence[Line] = LINES) -> str:
    """Markdown table of the figures that the table of a run holds.

    Args:
        table: Rows of all experiments.
        lines: What to show; lines without flights are left out.
    """
    text = [
        "| | QP | analytic law | published | flights, QP and analytic | redo it: `ibvs-qp` |",
        "|---|---|---|---|---|---|",
    ]
    for line in lines:
        rows = _matching(table, line)
        if rows.height:
            laws = [rows.filter(pl.col("law") == law) for law in ("qp", "paper")]
            count = ", ".join(str(each.height) if each.height else "–" for each in laws)
            figures = " | ".join(_figure(each, line) for each in laws)
            text.append(f"| {line.words} | {figures} | {line.published} | {count} | `experiment {line.experiment}` |")
    return "\n".join(text) + "\n"


def _matching(table: pl.DataFrame, line: Line) -> pl.DataFrame:
    rows = table.filter((pl.col("experiment") == line.experiment) & (pl.col("variant") == line.variant))
    for name, value in line.params.items():
        rows = rows.filter(pl.col(PARAM + name) == value) if PARAM + name in rows.columns else rows.clear()
    return rows


def _figure(rows: pl.DataFrame, line: Line) -> str:
    """Median with its interval over the flights that ended as planned, and how many did not."""
    if not rows.height:
        return "–"
    if line.at_least is not None:
        return f"{int((rows[line.metric].fill_null(0.0) >= line.at_least).sum())} of {rows.height}"
    done = rows.filter(pl.col("completed"))
    missed = rows.height - done.height
    fails = f"fails in {missed} of {rows.height}"
    values = line.scale * done[line.metric].drop_nulls().to_numpy()
    if not values.size:
        return fails
    middle, low, high = (rounded(value, line.digits) for value in median_interval(values).values())
    parts = [middle if low == high else f"{middle} ({low} to {high})"]
    for metric, words, scale, digits in line.also:
        more = done[metric].drop_nulls().to_numpy()
        parts += [words.format(rounded(scale * float(np.median(more)), digits))] if more.size else []
    return "; ".join([*parts, *([fails] if missed else [])])


def put_into(text: str, table: str) -> str:
    """A text with what stands between `BEGIN` and `END` replaced by a table.

    Raises:
        ValueError: When the marks are missing.
    """
    head, tail = text.index(BEGIN) + len(BEGIN), text.index(END)
    return f"{text[:head]}\n{table}{text[tail:]}"


if __name__ == "__main__":
    data, page = map(Path, sys.argv[1:3])
    page.write_text(put_into(page.read_text(encoding="utf-8"), digest(pl.read_parquet(data))), encoding="utf-8")
