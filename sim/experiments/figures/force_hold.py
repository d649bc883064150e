"""Push and edge error over time while holding a force, with and without impedance."""

from __future__ import annotations

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from sim.evaluate.window import CONTACT_N, PHYSICS_RATE_HZ
from sim.experiments.figures.common import Drawn, Results, stored_trace
from sim.experiments.figures.force_map import VARIANT_WORDS
from sim.experiments.spec import FigureSpec
from sim.figures.style import REFERENCE, law_colour, law_name, new_figure, note_empty
from sim.sweep.statistics import select

#: Shown before and after the first touch [s].
BEFORE_S, AFTER_S = 3.0, 9.0


def draw_force_hold(spec: FigureSpec, results: Results) -> Drawn:
    """Push and visual target with and without impedance, one figure per wall."""
    figures: Drawn = {}
    holds = select(results.table, spec.where, kind="hold")
    for stiffness in holds["param.stiffness_n_m"].unique(maintain_order=True) if holds.height else ():
        wall = f"{stiffness / 1000:g}"
        caption = f"Push and visual target with and without impedance, wall of {wall} kN/m"
        figures[f"force-hold-{wall}kNm"] = (caption, _hold(results, select(holds, stiffness_n_m=stiffness)))
    return figures


def _hold(results: Results, holds: pl.DataFrame) -> Figure:
    figure = new_figure(4.3)
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    for (variant, words), (above, below) in zip(VARIANT_WORDS.items(), grid.T, strict=True):
        reference = None
        for law in ("paper", "qp"):
            rows = select(holds, law=law, variant=variant)
            trace = stored_trace(results, rows)
            if trace is None or not np.any(trace.contact_1khz > CONTACT_N):
                continue
            touch = float(np.argmax(trace.contact_1khz > CONTACT_N)) / PHYSICS_RATE_HZ
            t = trace.t - trace.t[0] - touch
            near = (t > -BEFORE_S) & (t < AFTER_S)
            above.plot(t[near], trace.push_true[near], color=law_colour(law), label=law_name(law), linewidth=0.9)
            below.plot(t[near], trace.line_error_px[near, 0], color=law_colour(law), linewidth=0.9)
            reference = t[near], trace.push_reference[near]
        if reference is not None:
            above.plot(*reference, **REFERENCE, label="reference")
            below.axhline(0.0, **REFERENCE)
        else:
            for axes in (above, below):
                note_empty(axes, "not flown")
        above.set_title(words)
        below.set_xlabel("time since touch [s]")
    grid[0][0].set_ylabel("true push [N]")
    grid[1][0].set_ylabel("edge error at the tip [px]")
    grid[0][0].set_xlim(-BEFORE_S, AFTER_S)
    for axes in grid[0]:
        if axes.get_legend_handles_labels()[0]:
            axes.legend(loc="lower right")
            break
    return figure
