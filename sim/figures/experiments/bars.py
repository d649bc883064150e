"""Wrong beliefs side by side: path, push and tilt per error, both laws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from sim.figures.experiments.common import select
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
    for axes, (name, label, scale) in zip(grid, _PANELS, strict=True):
        for law, side in (("qp", -0.5), ("paper", 0.5)):
            rows = [select(results.table, law=law, error=error) for error in errors]
            values = [median_interval(row[name].drop_nulls().to_numpy())["median"] for row in rows]
            places = np.arange(len(errors)) + side * _BAR
            axes.barh(places, scale * np.array(values), height=_BAR, color=law_colour(law), label=law_name(law))
        axes.set_xlabel(label)
        axes.grid(visible=False, axis="y")
    grid[0].set_yticks(range(len(errors)), errors)
    grid[0].invert_yaxis()
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return {"payload": ("Path, push and tilt with one wrong belief at a time", figure)}
