"""Map of force gain, wall and sensor delay: push oscillation with and without impedance, and its predicted limit."""

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
#: Less steady contact than this fraction means that contact is lost; a larger deviation [N] means oscillation.
CONTACT_FRACTION, OSCILLATES_N = 0.995, 0.5
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
    """One row per law, variant and cell: deviation [N], lost, unstable (oscillates or lost), predicted unstable.

    In a flight that did not end as planned contact counts as lost.
    """
    lost = (pl.col("contact_share").fill_null(0.0).median() < CONTACT_FRACTION) | ~pl.col("completed").all()
    cells = table.group_by("law", "variant", *_CELL, maintain_order=True).agg(
        pl.col("force_std_n").median().alias("deviation"), lost.alias("lost"), pl.len().alias("flights")
    )
    damping = [predicted_damping(*key) for key in cells.select("law", "variant", *_CELL).iter_rows()]
    oscillates = (pl.col("deviation") > OSCILLATES_N).fill_null(False)
    return cells.with_columns((oscillates | pl.col("lost")).alias("unstable"), pl.Series("predicted", damping) < 0.0)


def map_caption(table: pl.DataFrame, holds: pl.DataFrame) -> str:
    """Direct force control against impedance, as counted in the map and in the holds at shipped gains."""
    cells = map_cells(table)
    unstable, parts = {}, []
    for variant, words in VARIANT_WORDS.items():
        own = cells.filter(pl.col("variant") == variant)
        unstable[variant] = own["unstable"].sum()
        gains = own.filter(pl.col("unstable"))[PARAM + "force_gain"]
        least = f", none below {gains.min():g} times the force gain" if gains.len() else ""
        parts.append(
            f"{words} {unstable[variant]} of {own.height} cells ({own['lost'].sum()} lost{least}; the predicted margin "
            f"agrees in {(own['unstable'] == own['predicted']).sum()})"
        )
    shipped = cells.filter((pl.col("variant") == "direct") & (pl.col(PARAM + "force_gain") == 1.0))
    calm = unstable["direct"] <= unstable["standard"] or (shipped.height and not shipped["unstable"].any())
    if unstable["direct"] > unstable["standard"]:
        head = "Direct force control oscillates in a region where impedance is stable"
        head += ", but not at the shipped gains" if calm else ""
    else:
        head = "Direct force control does not oscillate in more cells than impedance"
    tail = "; touch ramp, scheduled approach and the lag margin of the loop damp direct control "
    tail += "(docs/how_it_works/contact.md)"
    return (
        f"{head}. Push deviation above {OSCILLATES_N:g} N or contact lost: {', '.join(parts)}"
        f"{_shipped_deviation(holds)}{tail if calm else ''}"
    )


def _shipped_deviation(holds: pl.DataFrame) -> str:
    """Push deviation of both variants at shipped gains, per wall."""
    found = []
    for wall in sorted(holds[PARAM + "stiffness_n_m"].unique()) if holds.height else ():
        rows = [select(holds, variant=variant, stiffness_n_m=wall)["force_std_n"].median() for variant in VARIANT_WORDS]
        if None not in rows:
            found.append(f"{rows[1]:.3f} against {rows[0]:.3f} N at {wall / 1000:g} kN/m")
    return f"; at shipped gains the push of direct control deviates by {', '.join(found)}" if found else ""


def draw_gain_map(spec: FigureSpec, results: Results) -> Drawn:
    """The map of force gain, wall and delay."""
    table = select(results.table, spec.where, kind="map")
    if not table.height:
        return {}
    return {spec.name: (map_caption(table, select(results.table, spec.where, kind="hold")), draw_map(table))}


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
