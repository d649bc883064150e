"""Wrong beliefs side by side: path, push and tilt per error, both laws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from sim.experiments.figures.common import select
from sim.figures.style import law_colour, law_name, new_figure
from sim.sweep.parts import PARAM
from sim.sweep.statistics import median_interval

if TYPE_CHECKING:
    from sim.experiments.base import Results

_PANELS = (
    ("path_rms_m", "path error, rms [mm]", 1e3),
    ("force_rms_n", "push error, rms [N]", 1.0),
    ("tilt_peak_deg", "tilt, peak [deg]", 1.0),
)
_BAR = 0.38


def draw_payload(results: Results) -> dict[str, tuple[str, Figure]]:
    """Horizontal bars, one pair per error."""
    errors = list(results.table[PARAM + "error"].unique(maintain_order=True))
    figure = new_figure(0.9 + 0.3 * len(errors))
    grid = figure.subplots(1, len(_PANELS), sharey=True)
    crashed = False
    for axes, (name, label, scale) in zip(grid, _PANELS, strict=True):
        for law, side in (("qp", -0.5), ("paper", 0.5)):
            rows = [select(results.table, law=law, error=error) for error in errors]
            found = [median_interval(_completed(row, name)) for row in rows]
            middle, low, high = (
                scale * np.array([entry[part] for entry in found]) for part in ("median", "low", "high")
            )
            places = np.arange(len(errors)) + side * _BAR
            axes.barh(places, middle, height=_BAR, color=law_colour(law), label=law_name(law))
            ends = np.vstack((middle - low, high - middle))
            axes.errorbar(middle, places, xerr=ends, fmt="none", ecolor="#333333", capsize=1.5, linewidth=0.8)
            for place, row in zip(places, rows, strict=True):
                failed = int((~row["completed"]).sum())
                if failed:
                    axes.text(0.02, place, f"x {failed}", transform=axes.get_yaxis_transform(), va="center",
                              fontsize=7, color="#222222")  # fmt: skip
                    crashed = True
        axes.set_xlabel(label)
        axes.grid(visible=False, axis="y")
    grid[0].set_yticks(range(len(errors)), ["no error" if error == "nothing" else error for error in errors])
    grid[0].set_ylim(len(errors) - 0.4, -0.6)
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    note = "; x: flights that did not end as planned, left out" if crashed else ""
    return {"payload": (f"Path, push and tilt with one wrong belief at a time, medians with intervals{note}", figure)}


def _completed(rows: pl.DataFrame, name: str) -> np.ndarray:
    return rows.filter(pl.col("completed"))[name].drop_nulls().to_numpy()
