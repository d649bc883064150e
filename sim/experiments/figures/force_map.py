"""Map of force gain, wall and sensor delay: deviation of the push with and without impedance, and predicted limit."""

from __future__ import annotations

import functools

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import ibvs_qp
from ibvs_qp.config.contact_margin import contact_mode_damping
from sim.experiments.figures.common import Drawn, Results
from sim.experiments.spec import FigureSpec
from sim.experiments.variants import VARIANTS, with_force_gain
from sim.figures.style import law_name, new_figure
from sim.sweep.parts import PARAM
from sim.sweep.statistics import select
from sim.world.scene import ForceTorqueScene, WallScene

VARIANT_WORDS = {"standard": "impedance", "direct": "direct force control"}
#: Less steady contact than this fraction means that contact is lost.
CONTACT_FRACTION = 0.995
#: Cells with a smaller deviation are dark on the colour scale [N].
DARK_BELOW_N = 0.3
#: Ends of the colour scale of deviations [N].
SCALE_N = (0.005, 1.0)
_LIMIT = "#ff5a36"
_CELL = [PARAM + name for name in ("force_gain", "stiffness_n_m", "delay_s")]


@functools.lru_cache(maxsize=4096)
def predicted_damping(law: str, variant: str, gain: float, stiffness: float, delay_s: float) -> float:
    """Least damping ratio of the contact that the linear loop predicts; the push oscillates below zero.

    Args:
        law: Law at its shipped gains.
        variant: Key of `VARIANTS`.
        gain: Factor of `with_force_gain`.
        stiffness: Stiffness of the wall [N/m].
        delay_s: Latency of the force/torque sensor [s]; half a sample period is added.
    """
    config = with_force_gain(VARIANTS[variant].apply(ibvs_qp.preset(law)), gain).controller
    age = delay_s + 0.5 / ForceTorqueScene().rate_hz
    return contact_mode_damping(config, stiffness, WallScene().damping_n_s_m, age).least_damping_ratio


def map_cells(table: pl.DataFrame) -> pl.DataFrame:
    """One row per law, variant and cell: deviation [N], and whether contact was lost, or a flight failed."""
    lost = (pl.col("contact_share").fill_null(0.0).median() < CONTACT_FRACTION) | ~pl.col("completed").all()
    return table.group_by("law", "variant", *_CELL, maintain_order=True).agg(
        pl.col("force_std_n").median().alias("deviation"), lost.alias("lost"), pl.len().alias("flights")
    )


def draw_gain_map(spec: FigureSpec, results: Results) -> Drawn:
    """The map of force gain, wall and delay."""
    table = select(results.table, spec.where, kind="map")
    if not table.height:
        return {}
    return {spec.name: (spec.caption, draw_map(table))}


def draw_map(table: pl.DataFrame) -> Figure:
    """Steady deviation of the push per law, variant and delay; the predicted limit over it."""
    cells = map_cells(table)
    laws = [law for law in ("qp", "paper") if select(table, law=law).height]
    delays, walls, gains = (sorted(table[name].unique()) for name in (_CELL[2], _CELL[1], _CELL[0]))
    rows = [(law, variant) for law in laws for variant in VARIANT_WORDS]
    figure = new_figure(0.9 + 1.45 * len(rows))
    grid = figure.subplots(len(rows), len(delays), squeeze=False, sharex=True, sharey=True)
    image = None
    for (law, variant), line in zip(rows, grid, strict=True):
        own = select(cells, law=law, variant=variant)
        for axes, delay in zip(line, delays, strict=True):
            image = _panel(axes, select(own, delay_s=delay), gains, walls)
            margin = np.array([[predicted_damping(law, variant, g, w, delay) for w in walls] for g in gains])
            _limit(axes, margin)
            axes.set_xticks(range(len(walls)), [f"{wall / 1000:g}" for wall in walls])
            axes.set_yticks(range(len(gains)), [f"{gain:g}" for gain in gains])
            axes.grid(False)
        line[0].set_ylabel(f"{law_name(law)}\n{VARIANT_WORDS[variant]}\nforce gain [×]", fontsize=7.5)
    for axes, below, delay in zip(grid[0], grid[-1], delays, strict=True):
        axes.set_title(f"F/T delay {delay * 1e3:.0f} ms")
        below.set_xlabel("wall [kN/m], in steps")
    assert image is not None
    figure.colorbar(image, ax=grid, label="steady deviation of the push [N]", shrink=0.7, extend="both")
    seeds = sorted(set(cells["flights"]))
    many = f"{seeds[0]}" if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"
    keys = [
        Line2D([], [], color=_LIMIT, linewidth=1.4, label="predicted limit"),
        Line2D([], [], color=_LIMIT, marker=".", linestyle="none", label="predicted unstable"),
        Line2D([], [], linestyle="none", label=f"flights per cell: {many}"),
    ]
    figure.legend(handles=keys, loc="outside lower center", ncols=3)
    return figure


def _panel(axes: Axes, cells: pl.DataFrame, gains: list[float], walls: list[float]):
    values = np.full((len(gains), len(walls)), np.nan)
    for cell in cells.iter_rows(named=True):
        i, j = gains.index(cell[PARAM + "force_gain"]), walls.index(cell[PARAM + "stiffness_n_m"])
        if cell["deviation"] is not None:
            values[i, j] = cell["deviation"]
        if cell["lost"]:
            ink = "white" if values[i, j] <= DARK_BELOW_N else "black"
            axes.text(j, i + 0.2, "lost", ha="center", va="center", color=ink, fontsize=7)
    return axes.imshow(values, origin="lower", aspect="auto", norm=LogNorm(*SCALE_N), cmap="viridis")


def _limit(axes: Axes, margin: np.ndarray) -> None:
    """Line of no damping, and a dot in each cell on the unstable side of it."""
    i, j = np.nonzero(margin < 0.0)
    axes.plot(j, i - 0.25, ".", color=_LIMIT, markersize=4)
    if min(margin.shape) > 1 and margin.min() < 0.0 < margin.max():
        axes.contour(margin, levels=[0.0], colors=_LIMIT, linewidths=1.4)
