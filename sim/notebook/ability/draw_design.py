"""What bounds the push: travel and friction, place of the tip, a weak rotor; the map on which a design is chosen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sim.figures.style import REFERENCE, new_figure
from sim.notebook.ability.abilities import push_around, push_over_share, push_over_tip
from sim.notebook.ability.case import VehicleCase
from sim.notebook.ability.choice import DesignMap, Duties
from sim.notebook.ability.draw_vehicle import OURS, WEAK

#: Directions of travel drawn.
_AROUND = np.linspace(0.0, 2.0 * np.pi, 181)
#: Shares of full thrust of a weak rotor.
_SHARES = np.linspace(0.0, 1.0, 81)
#: Places of the tip: ahead and below the centre of mass [m].
_LENGTHS_M, _HEIGHTS_M = (0.5, 0.7, 0.9), np.linspace(-0.3, 0.3, 25)


def draw_sliding(case: VehicleCase, frictions: Sequence[float], asked: float) -> Figure:
    """Greatest push over the direction of travel, per friction, as the camera sees it; the asked one in colour."""
    figure = new_figure(3.5)
    axes = figure.add_subplot(projection="polar")
    for friction in sorted({*frictions, asked}):
        chosen = friction == asked
        style = {"color": OURS, "linewidth": 1.8} if chosen else {"color": "#999999", "linewidth": 0.8}
        axes.plot(-_AROUND, push_around(case, friction, _AROUND), label=f"friction {friction:g}", **style)
        axes.annotate(f"{friction:g}", (np.pi / 4, float(push_around(case, friction, np.array([-np.pi / 4]))[0])),
                      fontsize=6.5, color=style["color"])  # fmt: skip
    axes.set_xticks(np.radians([0, 90, 180, 270]), ["right", "up", "left", "down"])
    axes.set_title("Greatest push [N] by travel of the tip; numbers: friction", pad=12)
    axes.set_rlabel_position(112.5)  # type: ignore[attr-defined]
    return figure


def draw_tip(case: VehicleCase, friction: float) -> Figure:
    """Push over the height of the tip, standing still and whichever way it slides, for three arm lengths."""
    vehicle = case.vehicle
    still, sliding = push_over_tip(_LENGTHS_M, _HEIGHTS_M, vehicle.mass_kg, vehicle.geometry.tilt_deg, friction)
    figure = new_figure(2.7)
    grid = figure.subplots(1, 2, sharey=True)
    for length, row, shade in zip(_LENGTHS_M, sliding, (0.35, 0.65, 1.0), strict=True):
        grid[1].plot(1e2 * _HEIGHTS_M, row, color=OURS, alpha=shade, label=f"tip {length:g} m ahead")
    grid[0].plot(1e2 * _HEIGHTS_M, still[0], color=OURS)
    for axes, title in zip(grid, ("Standing still (any length)", f"Any travel, friction {friction:g}"), strict=True):
        axes.axvline(1e2 * vehicle.tip_position_m[2], **REFERENCE)
        axes.set(xlabel="tip below the centre of mass [cm]", title=title)
    grid[0].set_ylabel("greatest push [N]")
    grid[0].set_ylim(bottom=0.0)
    grid[1].legend(fontsize=7)
    return figure


def draw_derate(case: VehicleCase) -> Figure:
    """Pushes that can be held while one rotor gives only a share of its thrust: a mid one, an outer one."""
    vehicle = case.vehicle
    figure = new_figure(2.7)
    grid = figure.subplots(1, 2, sharey=True)
    for axes, rotor in zip(grid, ("mid_right", "front_right"), strict=True):
        reach = push_over_share(rotor, _SHARES, vehicle.mass_kg, vehicle.geometry.tilt_deg)
        axes.fill_between(1e2 * _SHARES, reach[:, 0], reach[:, 1], color=OURS, alpha=0.3, linewidth=0)
        axes.plot(1e2 * _SHARES, reach[:, 1], color=OURS)
        axes.plot(1e2 * _SHARES, reach[:, 0], color=WEAK)
        if case.weak_rotor and case.share < 1.0:
            axes.axvline(1e2 * case.share, **REFERENCE)
        axes.set(xlabel="share of full thrust left [%]", title=rotor.replace("_", " ") + " weak", xlim=(0, 100))
    grid[0].set_ylabel("push that can be held [N]")
    handles = [Line2D([], [], color=OURS, label="greatest"), Line2D([], [], color=WEAK, label="least")]
    grid[1].legend(handles=handles, loc="lower right")
    return figure


def draw_design_map(designs: DesignMap, duties: Duties, nominal: VehicleCase) -> Figure:
    """Hover power over mass and tilt, the border of every duty, what meets them all, and the cheapest of those."""
    figure = new_figure(3.9)
    axes = figure.subplots()
    x, y = designs.masses_kg, designs.tilts_deg
    power = axes.contour(x, y, designs.power_w, levels=12, colors="#bbbbbb", linewidths=0.7)
    axes.clabel(power, fmt="%.0f W", fontsize=6)
    axes.contourf(x, y, designs.spare(duties), levels=[0.0, np.inf], colors=[OURS], alpha=0.18)
    handles = []
    for values, bound, colour, words in (
        (designs.push_n, duties.push_n, "#0b6f9e", f"push {duties.push_n:g} N, standing"),
        (designs.sliding_n, duties.sliding_push_n, "#d55e1a", f"push {duties.sliding_push_n:g} N, any travel"),
        (designs.gust_n, duties.gust_n, "#3a8a4d", f"{duties.gust_n:g} N from any side"),
    ):
        if np.nanmin(values) < bound < np.nanmax(values):
            axes.contour(x, y, np.nan_to_num(values), levels=[bound], colors=[colour], linewidths=1.4)
        handles.append(Line2D([], [], color=colour, label=words))
    axes.axvline(duties.least_mass_kg, color="#333333", linewidth=1.0)
    handles.append(Line2D([], [], color="#333333", label=f"least mass {duties.least_mass_kg:g} kg"))
    vehicle = nominal.vehicle
    axes.plot(vehicle.mass_kg, vehicle.geometry.tilt_deg, "s", color="#333333", markersize=5)
    axes.annotate(" Tarot T960", (vehicle.mass_kg, vehicle.geometry.tilt_deg), fontsize=7, va="bottom")
    best = designs.cheapest(duties)
    if best is not None:
        place = (best.vehicle.mass_kg, best.vehicle.geometry.tilt_deg)
        axes.plot(*place, "*", color=WEAK, markersize=13, zorder=5)
        axes.annotate(f"   cheapest: {best.hover_power_w:.0f} W", place, fontsize=7, va="top", color=WEAK)
    axes.set(xlabel="all-up mass [kg]", ylabel="rotor tilt [deg]", title="Shaded: meets every duty; grey: hover power")
    axes.grid(visible=False)
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=7)
    return figure
