"""Figure of notebook 02: response on the left; limits, multipliers and margins on the right."""

from __future__ import annotations

import dataclasses

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ibvs_qp.config.vehicle import VehicleParams
from sim.evaluate.paint_plan import CONTACT_N
from sim.evaluate.window import tilt_deg
from sim.figures.style import REFERENCE, note_empty
from sim.flight.trace import Trace
from sim.notebook.common import BLUE, ORANGE, RED
from sim.notebook.tuning import Comparison, reach_note
from sim.notebook.vehicle import Case
from sim.notebook.wall_flights import HOVER_S

#: Size of the figure [in] and place of its panels; a fixed layout takes half the time of a fitted one.
SIZE_IN = (11.0, 7.2)
MARGINS = {"left": 0.055, "right": 0.93, "top": 0.92, "bottom": 0.07, "wspace": 0.27, "hspace": 0.4}
#: Names and styles of the flights, in the order of drawing.
STYLES = {
    "analytic law": {"color": ORANGE, "linewidth": 0.9},
    "QP before": {"color": "#6db3d6", "linewidth": 0.9},
    "QP now": {"color": BLUE, "linewidth": 1.3},
}
#: Limits shown at most, and decades of their colour scale.
MOST_LIMITS, DECADES = 7, 4.0
#: The tilt bound is drawn below this many times the greatest tilt; top of its axes over the largest value [-].
NEAR_BOUND, TILT_HEADROOM = 1.5, 1.2
#: One dot of force per so many ticks.
EVERY = 8


def draw_dashboard(comparison: Comparison) -> Figure:
    """Push, image error, tilt; limits with their multipliers, room to the limits, and the attainable forces."""
    figure = Figure(figsize=SIZE_IN)
    figure.set_layout_engine("none")
    grid = figure.subplots(3, 2, gridspec_kw={**MARGINS, "height_ratios": [1.0, 1.0, 1.15]})
    flights = {name: comparison.flights[name] for name in STYLES}
    push, error, tilt = grid[:, 0]
    limits, room, reach = grid[:, 1]

    _curves(push, flights, {name: trace.push_true for name, trace in flights.items()})
    push.plot(comparison.now.t, comparison.now.push_reference, **REFERENCE, label="reference")
    push.set(title="push on the board", ylabel="push [N]")
    if note := reach_note(comparison.now):
        push.annotate(f"reach check:\n{note}", (0.015, 0.95), xycoords="axes fraction", va="top", fontsize=8, color=RED)

    errors = {name: trace.line_error_px[:, 0] for name, trace in flights.items()}
    greatest = max(4.0, _greatest(flights, errors))
    _curves(error, flights, errors)
    error.axhline(0.0, color="#333333", linewidth=0.6)
    error.set(
        title="guide line in the picture, at the tip", ylabel="error [px]", ylim=(-1.1 * greatest, 1.1 * greatest)
    )

    tilts = {name: tilt_deg(trace) for name, trace in flights.items()}
    greatest = max(0.2, _greatest(flights, tilts))
    _curves(tilt, flights, tilts)
    bounds = comparison.setting.pilot.controller.limits
    top = greatest
    if bounds.tilt_barrier and bounds.tilt_deg < NEAR_BOUND * greatest:
        top = max(greatest, bounds.tilt_deg)
        tilt.axhline(bounds.tilt_deg, color=RED, linewidth=0.9, linestyle=(0, (5, 2)))
        tilt.annotate("bound on roll and on pitch", (0.01, bounds.tilt_deg), xycoords=("axes fraction", "data"),
                      va="bottom", fontsize=7, color=RED)  # fmt: skip
    tilt.set(title="tilt of the vehicle", ylabel="tilt [°]", xlabel="time [s]", ylim=(0.0, TILT_HEADROOM * top))

    _draw_multipliers(limits, comparison)

    _curves(room, flights, {name: thrust_room(trace) for name, trace in flights.items()})
    room.axhline(0.0, color=RED, linewidth=0.9)
    room.set(title="room of the rotor that is nearest to a limit", ylabel="room [N]", xlabel="time [s]")
    room.set_ylim(bottom=-0.5)

    _draw_reach(reach, flights, comparison)
    end = max(float(trace.t[-1]) for trace in flights.values())
    for axes in (push, error, tilt, limits, room):
        axes.set_xlim(0.0, end)
    handles, labels = push.get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper left", ncols=4)
    return figure


def thrust_room(trace: Trace) -> np.ndarray:
    """Distance of the nearest rotor to one of its limits [N], (N,).

    With six rotors the thrusts of a wrench are unique, so this is the margin of the wrench in the attainable set.
    """
    return np.minimum(trace.thrusts - trace.thrust_min, trace.thrust_max - trace.thrusts).min(axis=1)


def _greatest(flights: dict[str, Trace], values: dict[str, np.ndarray]) -> float:
    """Greatest finite magnitude after the take-over of the hover."""
    late = np.concatenate([values[name][trace.t > HOVER_S] for name, trace in flights.items()])
    return float(np.abs(late[np.isfinite(late)]).max(initial=0.0))


def _curves(axes: Axes, flights: dict[str, Trace], values: dict[str, np.ndarray]) -> None:
    for name, trace in flights.items():
        axes.plot(trace.t, values[name], label=name, **STYLES[name])  # type: ignore[arg-type]


def _draw_multipliers(axes: Axes, comparison: Comparison) -> None:
    """Draw one row of marks per active limit, coloured by its multiplier; the small marks are the flight before."""
    axes.set_title("active limits and their multipliers (small: before)")
    now, last = comparison.now, comparison.last
    totals: dict[str, float] = {}
    for trace in (last, now):
        totals |= dict(zip(trace.limits, np.nansum(trace.limit_price, axis=0).tolist(), strict=True))
    names = sorted(totals, key=lambda name: -totals[name])[:MOST_LIMITS]
    if not names:
        note_empty(axes, "no limit was active")
        axes.set_yticks([])
        return
    top = max(1.0, *(float(np.nanmax(trace.limit_price, initial=0.0)) for trace in (now, last)))
    norm = LogNorm(top / 10.0**DECADES, top, clip=True)
    for trace, offset, size in ((last, 0.36, 12.0), (now, -0.06, 190.0)):
        for row, name in enumerate(names):
            if name in trace.limits:
                multiplier = trace.limit_price[:, trace.limits.index(name)]
                active = multiplier > 0.0
                axes.scatter(trace.t[active], np.full(active.sum(), row + offset), size, multiplier[active],
                             linewidths=1.0, norm=norm, cmap="viridis_r", marker="|")  # fmt: skip
    active = {name: 100.0 * float(now.active[:, now.limits.index(name)].mean()) for name in names if name in now.limits}
    labels = [f"{name.replace('_', ' ')}\n{active.get(name, 0.0):.1f} %" for name in names]
    axes.set_yticks(range(len(names)), labels, fontsize=6.8)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    assert axes.figure is not None
    bar = axes.figure.colorbar(
        ScalarMappable(norm, "viridis_r"), cax=axes.inset_axes((1.01, 0.0, 0.016, 1.0)), label="|d cost / d bound|"
    )
    bar.minorticks_off()


def _draw_reach(axes: Axes, flights: dict[str, Trace], comparison: Comparison) -> None:
    """Draw the forces attainable in level flight now and, as an outline, before; and dots for those in contact."""
    nominal = comparison.setting.pilot.controller.vehicle
    if nominal.geometry.count == 6:
        _draw_cuts(axes, *(_rotors(flights[name], nominal).level_cut() for name in ("QP now", "QP before")))
    else:
        note_empty(axes, "the attainable set is drawn for six rotors only")
    for name, trace in flights.items():
        thrusts = trace.thrusts_actual[trace.push_true > CONTACT_N][::EVERY]
        front, right = _rotors(trace, nominal).matrix[:2] @ thrusts.T
        axes.plot(right, front, ".", color=STYLES[name]["color"], markersize=2.5)
    axes.axhline(0.0, color="#999999", linewidth=0.5)
    axes.axvline(0.0, color="#999999", linewidth=0.5)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(title="forces attainable in level flight, and those in contact")
    axes.set(xlabel="force to the right [N]", ylabel="force to the front [N]")


def _draw_cuts(axes: Axes, now: np.ndarray, before: np.ndarray) -> None:
    if len(now):
        axes.fill(*now.T, facecolor="#e9eef1", edgecolor="#888888", linewidth=0.9)
    else:
        axes.text(0.5, 0.9, "these rotors cannot carry the vehicle", transform=axes.transAxes, ha="center", fontsize=8)
    axes.fill(*before.T, facecolor="none", edgecolor=STYLES["QP before"]["color"], linewidth=0.5)


def _rotors(trace: Trace, nominal: VehicleParams) -> Case:
    """Vehicle with the mass and the thrust limits of a flight; all flights of a comparison have the same rotors."""
    low, high = tuple(trace.thrust_min.tolist()), tuple(trace.thrust_max.tolist())
    flown = {"mass_kg": trace.true_mass.item(), "thrust_min_n": low, "thrust_max_n": high}
    return Case(vehicle=dataclasses.replace(nominal, **flown))
