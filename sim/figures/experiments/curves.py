"""Figures of merit over one parameter, both laws, medians with intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from sim.figures.experiments.common import plot_medians, select
from sim.figures.style import law_name, new_figure
from sim.sweep.parts import PARAM

if TYPE_CHECKING:
    from sim.experiments.base import Results

#: Line style of the variants, in the order given.
_DASHES = ("-", ":", "--")


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
        variants: Variants drawn, the first with a full line.
    """

    def draw(results: Results) -> dict[str, tuple[str, Figure]]:
        figure = new_figure(2.7)
        for axes, panel in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
            table = select(results.table, **panel.where)
            values = table[PARAM + x].drop_nulls() if PARAM + x in table.columns else None
            shift = 0.012 * (float(values.max()) - float(values.min())) if values is not None and values.len() else 0.0  # type: ignore[arg-type]
            for law in ("qp", "paper"):
                for variant, dash in zip(variants, _DASHES, strict=False):
                    label = law_name(law) + (f", {variant}" if len(variants) > 1 else "")
                    plot_medians(
                        axes,
                        select(table, law=law, variant=variant),
                        x,
                        panel.metric,
                        law,
                        scale=panel.scale,
                        shift=shift if law == "paper" else -shift,
                        linestyle=dash,
                        label=label,
                        linewidth=1.0,
                    )
            axes.set(xlabel=panel.xlabel or xlabel, ylabel=panel.label)
            if axes.lines:
                axes.set_ylim(0.0, max(1.12 * float(axes.dataLim.y1), 1e-9))
            else:
                axes.text(0.5, 0.5, "no flight came so far", transform=axes.transAxes, ha="center", color="#777777")
        handles, labels = figure.axes[0].get_legend_handles_labels()
        if handles:
            figure.legend(handles, labels, loc="outside lower center", ncols=4)
        return {name: (caption, figure)}

    return draw
