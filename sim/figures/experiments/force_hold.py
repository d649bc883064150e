"""Force holding with and without impedance, and the map of where direct force control oscillates."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ibvs_qp.loop_margin import contact_mode_damping
from sim.closed_loop import default_preset
from sim.experiments.variants import VARIANTS
from sim.figures.experiments.common import kept_trace, select
from sim.figures.style import REFERENCE, law_colour, law_name, new_figure
from sim.measures.window import CONTACT_N, PHYSICS_RATE_HZ
from sim.scene import ForceTorqueScene, WallScene
from sim.sweep.parts import PARAM

if TYPE_CHECKING:
    from sim.experiments.base import Results

#: Shown before and after the first touch [s].
BEFORE_S, AFTER_S = 3.0, 9.0
#: A hold whose steady part has less contact than this has lost the wall.
KEPT_SHARE = 0.995
#: Cells with a smaller deviation are dark on the colour scale [N].
DARK_BELOW_N = 0.6
_VARIANTS = {"standard": "impedance", "direct": "direct force control"}


def draw_force_hold(results: Results) -> dict[str, tuple[str, Figure]]:
    """Force and visual target with and without impedance, per wall; the map of both."""
    figures = {}
    holds = select(results.table, kind="hold")
    for stiffness in holds["param.stiffness_n_m"].unique(maintain_order=True) if holds.height else ():
        name = f"force-hold-{stiffness / 1000:g}kNm"
        caption = f"Push and visual target with and without impedance, wall of {stiffness / 1000:g} kN/m"
        figures[name] = (caption, _hold(results, stiffness))
    if select(results.table, kind="map").height:
        figures["force-hold-map"] = ("Where direct force control oscillates and impedance does not", _map(results))
    return figures


def _hold(results: Results, stiffness: float) -> Figure:
    figure = new_figure(4.3)
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    for (variant, words), (above, below) in zip(_VARIANTS.items(), grid.T, strict=True):
        for law in ("paper", "qp"):
            rows = select(results.table, law=law, variant=variant, kind="hold", stiffness_n_m=stiffness)
            trace = kept_trace(results, rows)
            if trace is None or not np.any(trace.contact_1khz > CONTACT_N):
                continue
            touch = float(np.argmax(trace.contact_1khz > CONTACT_N)) / PHYSICS_RATE_HZ
            t = trace.t - trace.t[0] - touch
            near = (t > -BEFORE_S) & (t < AFTER_S)
            above.plot(t[near], trace.push_true[near], color=law_colour(law), label=law_name(law), linewidth=0.9)
            below.plot(t[near], trace.line_error_px[near, 0], color=law_colour(law), linewidth=0.9)
            reference = trace.push_reference[near]
        above.plot(t[near], reference, **REFERENCE, label="reference")
        below.axhline(0.0, **REFERENCE)
        above.set_title(words)
        below.set_xlabel("time since touch [s]")
    grid[0][0].set_ylabel("true push [N]")
    grid[1][0].set_ylabel("edge error at the tip [px]")
    grid[0][0].set_xlim(-BEFORE_S, AFTER_S)
    grid[0][0].legend(loc="lower right")
    return figure


@functools.lru_cache(maxsize=4096)
def predicted_damping(law: str, variant: str, gain: float, stiffness: float, delay_s: float) -> float:
    """Least damping ratio of the contact that the linear loop predicts; below zero the push oscillates ever more.

    Args:
        law: Whose shipped gains.
        variant: Key of `VARIANTS`.
        gain: Factor on K_fp and K_fi.
        stiffness: Of the wall [N/m].
        delay_s: Latency of the force/torque sensor [s]; half a sample period comes on top.
    """
    from sim.experiments.force_hold import with_force_gain

    config = VARIANTS[variant].apply(with_force_gain(default_preset(law), gain)).controller
    age = delay_s + 0.5 / ForceTorqueScene().rate_hz
    return contact_mode_damping(config, stiffness, WallScene().damping_n_s_m, age).least_damping_ratio


def _map(results: Results) -> Figure:
    table = select(results.table, kind="map")
    laws = [law for law in ("qp", "paper") if select(table, law=law).height]
    delays = sorted(table[PARAM + "delay_s"].unique())
    walls, gains = (sorted(table[PARAM + name].unique()) for name in ("stiffness_n_m", "force_gain"))
    figure = new_figure(0.7 + 1.55 * len(laws) * 2)
    grid = figure.subplots(2 * len(laws), len(delays), squeeze=False, sharex=True, sharey=True)
    image = None
    for row, (law, variant) in enumerate((law, variant) for law in laws for variant in _VARIANTS):
        for axes, delay in zip(grid[row], delays, strict=True):
            values, lost, margin = (np.full((len(gains), len(walls)), np.nan) for _ in range(3))
            for i, gain in enumerate(gains):
                for j, wall in enumerate(walls):
                    cell = select(table, law=law, variant=variant, force_gain=gain, stiffness_n_m=wall, delay_s=delay)
                    if cell.height:
                        share = cell["contact_share"].fill_null(0.0)
                        values[i, j] = cell["force_std_n"].fill_null(np.nan).median()
                        lost[i, j] = bool(np.median(share.to_numpy()) < KEPT_SHARE)
                    margin[i, j] = predicted_damping(law, variant, gain, wall, delay)
            image = axes.imshow(values, origin="lower", aspect="auto", norm=LogNorm(0.03, 3.0), cmap="viridis")
            for i, j in zip(*np.nonzero(lost == 1.0), strict=True):
                ink = "black" if values[i, j] > DARK_BELOW_N else "white"
                axes.text(j, i, "lost", ha="center", va="center", color=ink, fontsize=6.5)
            if min(margin.shape) > 1 and np.ptp(margin) > 0 and margin.min() < 0.0 < margin.max():
                axes.contour(margin, levels=[0.0], colors="#ff5a36", linewidths=1.4)
            axes.set_xticks(range(len(walls)), [f"{wall / 1000:g}" for wall in walls])
            axes.set_yticks(range(len(gains)), [f"{gain:g}" for gain in gains])
            axes.grid(False)
            if row == 0:
                axes.set_title(f"F/T delay {delay * 1e3:.0f} ms")
            if row == 2 * len(laws) - 1:
                axes.set_xlabel("wall [kN/m]")
        grid[row][0].set_ylabel(f"{law_name(law)}\n{_VARIANTS[variant]}\nforce gain [×]", fontsize=7)
    if image is not None:
        figure.colorbar(image, ax=grid, label="steady deviation of the push [N]; red: predicted limit", shrink=0.8)
    return figure
