"""Figures of merit over one parameter, both laws, medians with intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.experiments.figures.common import legend_below, plot_medians, select
from sim.figures.style import law_name, new_figure
from sim.sweep.parts import PARAM

if TYPE_CHECKING:
    from sim.experiments.base import Results

#: Line style of the variants, in the order given.
_DASHES = ("-", ":", "--")
#: Parameters that span a decade.
_LOGARITHMIC = ("stiffness_n_m",)


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One axis: figure, label with unit, factor, and which rows it shows."""

    metric: str
    label: str
    scale: float = 1.0
    where: dict[str, Any] = field(default_factory=dict)
    xlabel: str = ""


def curves(
    name: str, caption: str, x: str, xlabel: str, panels: tuple[Panel, ...], variants: tuple[str, ...] = ("standard",)
) -> Callable[[Results], dict[str, tuple[str, Figure]]]:
    """Make the function that draws one row of panels.

    Args:
        name: File name.
        caption: Caption.
        x: Parameter along x.
        xlabel: Its label with unit.
        panels: Panels from left to right.
        variants: Variants drawn first, the first of them with a full line; others that were flown follow.
    """

    def draw(results: Results) -> dict[str, tuple[str, Figure]]:
        figure = new_figure(2.9)
        flown = results.table["variant"].unique(maintain_order=True).to_list()
        shown = [*variants, *(variant for variant in flown if variant not in variants)]
        for axes, panel in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
            _panel(axes, select(results.table, **panel.where), panel, x, shown)
            axes.set(xlabel=panel.xlabel or xlabel, ylabel=panel.label)
        legend_below(figure, 3, fontsize=7.5)
        return {name: (caption, figure)}

    return draw


def _panel(axes: Axes, table: pl.DataFrame, panel: Panel, x: str, variants: list[str]) -> None:
    values = table[PARAM + x].drop_nulls() if PARAM + x in table.columns else pl.Series([], dtype=pl.Float64)
    places = sorted(float(value) for value in values.unique())
    if x in _LOGARITHMIC and len(places) > 1:
        axes.set_xscale("log")
        axes.set_xticks(places, [f"{place:g}" for place in places], rotation=45)
        axes.minorticks_off()
        apart = 0.04
    else:
        apart = 0.024 * (places[-1] - places[0]) if places else 0.0
    for law, side in (("qp", -0.5), ("paper", 0.5)):
        for variant, dash in zip(variants, _DASHES, strict=False):
            label = law_name(law) + (f", {variant}" if len(variants) > 1 else "")
            plot_medians(
                axes, select(table, law=law, variant=variant), x, panel.metric, law, scale=panel.scale,
                shift=side * apart, linestyle=dash, label=label, linewidth=1.0,
            )  # fmt: skip
    if axes.lines:
        _bounds(axes, table, panel, x, places)
        axes.set_ylim(0.0, max(1.12 * float(axes.dataLim.y1), 1e-9))
    else:
        axes.text(0.5, 0.5, "no flight came so far", transform=axes.transAxes, ha="center", color="#777777")


def _bounds(axes: Axes, table: pl.DataFrame, panel: Panel, x: str, places: list[float]) -> None:
    """What the QP law is held to, as a thin line over the cells that it holds for."""
    from sim.experiments import experiment  # experiments are defined with their figures: not at import time

    step = min(np.diff(places), default=1.0)
    for criterion in experiment(table["experiment"][0]).criteria:
        params = dict(criterion.params)
        at = params.pop(x, None)
        fits = all(panel.where.get(name, value) == value for name, value in params.items())
        if criterion.metric != panel.metric or criterion.variant != "standard" or not fits:
            continue
        low, high = (places[0], places[-1]) if at is None else (float(at) - 0.4 * step, float(at) + 0.4 * step)
        bound = panel.scale * criterion.bound
        axes.plot([low, high], [bound, bound], color="#555555", linewidth=0.7, linestyle=(0, (6, 3)), label="bound")
