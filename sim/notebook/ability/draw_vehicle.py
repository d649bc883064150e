"""A vehicle from above, the cuts through its attainable wrench set, and the thrusts of a push."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from sim.figures.style import FAINT, LAW_COLOURS, REFERENCE, new_figure
from sim.notebook.ability.abilities import push_thrusts
from sim.notebook.ability.case import VehicleCase
from sim.notebook.ability.cuts import level_cut, side_cut, yaw_cut

OURS, WEAK = LAW_COLOURS["qp"], LAW_COLOURS["paper"]
#: Length of the arrow that shows where a rotor pushes sideways, per unit of sin(tilt) [m].
_ARROW_M = 0.36
#: Blank around a cut, as a share of its size.
_ROOM = 0.12


def draw_cuts(case: VehicleCase, nominal: VehicleCase) -> Figure:
    """Seen from above; level forces; forces in the vertical plane; push against yaw; the nominal outline behind."""
    figure = new_figure(5.6)
    top = figure.subplots(2, 2)
    _sketch(top[0, 0], case)
    for axes, cut, swap, labels, title in (
        (top[0, 1], level_cut, True, ("force to the right [N]", "force to the front [N]"), "Level, lift = weight"),
        (top[1, 0], side_cut, False, ("force to the front [N]", "lift [N]"), "No sideways force, no moment"),
        (top[1, 1], yaw_cut, True, ("yaw moment [N m]", "force to the front [N]"), "Push and yaw share the thrust"),
    ):
        _cut(axes, cut(nominal), swap, {"facecolor": "none", "edgecolor": "#999999", "linestyle": "--"})
        corners = cut(case)
        _cut(axes, corners, swap, {"facecolor": OURS, "alpha": 0.3, "edgecolor": OURS})
        if not len(corners):
            axes.text(
                0.5, 0.5, "nothing: level hover\nis out of reach", transform=axes.transAxes, ha="center", color=WEAK
            )
        axes.set(xlabel=labels[0], ylabel=labels[1], title=title)
    top[0, 1].set_aspect("equal", adjustable="datalim")
    top[1, 0].axhline(case.weight_n, **REFERENCE)
    top[1, 0].annotate("weight", (0.02, case.weight_n), xycoords=("axes fraction", "data"), va="bottom", fontsize=7)
    for axes in (top[0, 1], top[1, 1]):
        axes.plot(0.0, 0.0, "+", color="#333333", markersize=7)
    return figure


def _cut(axes: Axes, corners: np.ndarray, swap: bool, style: dict) -> None:
    if len(corners):
        first, second = corners.T
        axes.fill(*((second, first) if swap else (first, second)), linewidth=1.0, **style)


def _sketch(axes: Axes, case: VehicleCase) -> None:
    """Discs, sideways push of every rotor at equal thrust, and the arm; front is up, right is right."""
    vehicle = case.vehicle
    geometry = vehicle.geometry
    for name, place, axis in zip(geometry.names, geometry.positions, geometry.axes, strict=True):
        colour = WEAK if name == case.weak_rotor and case.share < 1.0 else OURS
        axes.add_patch(
            Circle((place[1], place[0]), vehicle.propeller_radius_m, facecolor=colour, alpha=0.18, edgecolor=colour)
        )
        axes.plot([0.0, place[1]], [0.0, place[0]], color=FAINT, linewidth=2.0, zorder=0)
        axes.annotate(
            "",
            (place[1] + _ARROW_M * axis[1], place[0] + _ARROW_M * axis[0]),
            (place[1], place[0]),
            arrowprops={"arrowstyle": "->", "color": colour, "linewidth": 1.2},
        )
        axes.text(place[1], place[0] - 0.155, name.replace("_", " "), fontsize=6, ha="center", color="#555555")
    tip = vehicle.tip_position_m
    axes.plot([0.0, tip[1]], [0.0, tip[0]], color="#333333", linewidth=2.0)
    axes.plot(tip[1], tip[0], "o", color="#333333", markersize=4)
    axes.text(tip[1] + 0.04, tip[0], f"tip, {tip[2]:+.2f} m down" if tip[2] else "tip", fontsize=7, va="center")
    axes.set(xlabel="right [m]", ylabel="front [m]", title="From above", xlim=(-0.85, 0.85), ylim=(-0.75, 0.95))
    axes.set_aspect("equal")


def draw_thrusts(case: VehicleCase, push_n: float) -> Figure:
    """Thrusts of hover and of a static push, with the limits of every rotor."""
    figure = new_figure(2.6)
    axes = figure.subplots()
    names = [name.replace("_", " ") for name in case.vehicle.geometry.names]
    places, pushing = np.arange(len(names)), push_thrusts(case, push_n)
    outside = (pushing < case.lower - 1e-9) | (pushing > case.upper + 1e-9)
    axes.bar(places - 0.2, case.hover_thrusts, width=0.36, color=FAINT, label="hover")
    axes.bar(
        places + 0.2,
        pushing,
        width=0.36,
        color=[WEAK if out else OURS for out in outside],
        label=f"push {push_n:g} N" + (", out of reach" if outside.any() else ""),
    )
    for place, low, high in zip(places, case.lower, case.upper, strict=True):
        axes.plot([place - 0.42, place + 0.42], [low, low], color="#333333", linewidth=1.0)
        axes.plot([place - 0.42, place + 0.42], [high, high], color="#333333", linewidth=1.0, linestyle=":")
    axes.set_xticks(places, names)
    axes.set(ylabel="thrust [N]", title="Thrusts; full line: idle floor, dots: ceiling")
    axes.legend(loc="upper right", bbox_to_anchor=(1.0, 1.16), ncols=2)
    axes.grid(visible=False, axis="x")
    return figure
