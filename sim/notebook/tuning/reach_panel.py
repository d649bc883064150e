"""The horizontal forces that the rotors attain in level flight, and those flown in contact."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from allocation import TAROT_T960, WrenchFacets, control_effectiveness, hover_wrench, level_polygon
from ibvs_qp.frames import GRAVITY
from sim.evaluate.path_error import CONTACT_N
from sim.flight.trace import Trace

#: One dot in so many ticks.
EVERY = 8
#: Room around what is shown [N].
RIM_N = 2.0


@functools.lru_cache(maxsize=64)
def _corners(mass_kg: float, lower: tuple[float, ...], upper: tuple[float, ...]) -> np.ndarray | None:
    """Level polygon (front, right) [N]; None where the rotors cannot carry the vehicle."""
    facets, weight, limits = WrenchFacets(TAROT_T960), mass_kg * GRAVITY, (np.array(lower), np.array(upper))
    return level_polygon(facets, weight, *limits) if facets.contains(hover_wrench(weight), *limits) else None


def _polygon(trace: Trace) -> np.ndarray | None:
    limits = (tuple(map(float, limit)) for limit in (trace.thrust_min, trace.thrust_max))
    return _corners(trace.scene.vehicle.mass_kg, *limits)


def draw_reach(axes: Axes, flights: dict[str, Trace], looks: dict[str, dict[str, Any]]) -> None:
    """Polygon of the present limits, outline of those before, a dot for the force of every few ticks in contact."""
    now, last = _polygon(flights["now"]), _polygon(flights["last"])
    if now is not None:
        axes.fill(now[:, 1], now[:, 0], facecolor="#e9eef1", edgecolor="#888888", linewidth=0.9)
    else:
        axes.text(0.5, 0.9, "these rotors cannot carry the vehicle", transform=axes.transAxes, ha="center", fontsize=8)
    if last is not None and (now is None or last.shape != now.shape or not np.allclose(last, now)):
        axes.plot(*np.vstack((last, last[:1]))[:, ::-1].T, color=looks["last"]["color"], linewidth=0.9)
    matrix = control_effectiveness(TAROT_T960)[:2]
    for name, trace in flights.items():
        touching = trace.push_true > CONTACT_N
        front, right = matrix @ trace.thrusts_actual[touching][::EVERY].T
        axes.plot(right, front, ".", color=looks[name]["color"], markersize=2.5)
    axes.axhline(0.0, color="#999999", linewidth=0.5)
    axes.axvline(0.0, color="#999999", linewidth=0.5)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(title="forces attainable in level flight, and those flown in contact")
    axes.set(xlabel="force to the right [N]", ylabel="force to the front [N]")
    axes.margins(0.04)
