"""Figures of merit of the flights that a change is judged by, as a table."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sim.evaluate.path_error import CONTACT_N
from sim.evaluate.window import board_tip, peak, phase_window, rms, tilt_deg
from sim.flight.trace import Trace
from sim.notebook.tuning.bench import Comparison

#: The hold is judged after the ramp of the reference, the slide after its start [s].
SETTLED_S, SLIDING_S = 1.1, 0.3


def _after_touch(trace: Trace, delay: float = 0.0) -> np.ndarray:
    """Ticks from so long after the first touch on, (N,) bool."""
    touching = trace.push_true > CONTACT_N
    if not touching.any():
        return np.zeros(len(trace.t), bool)
    return trace.t >= trace.t[np.argmax(touching)] + delay


def _holding(trace: Trace) -> np.ndarray:
    _, end = phase_window(trace, "press")
    return _after_touch(trace, SETTLED_S) & (trace.t <= end)


def _sliding(trace: Trace) -> np.ndarray:
    begin, end = phase_window(trace, "paint")
    return (trace.t >= begin + SLIDING_S) & (trace.t <= end)


def _height_mm(trace: Trace, ticks: np.ndarray) -> float:
    return 1e3 * rms(board_tip(trace)[ticks, 1] - trace.scene.paint.edge_margin_m)


def _jitter(trace: Trace) -> float:
    return rms(np.diff(trace.thrusts[_after_touch(trace, SETTLED_S)], axis=0))


def _least(values: np.ndarray) -> float:
    good = values[np.isfinite(values)]
    return float(good.min()) if len(good) else math.nan


def thrust_room(trace: Trace) -> np.ndarray:
    """Distance of the nearest rotor to one of its limits [N], (N,).

    With six rotors a wrench has one allocation, so this is the margin of the wrench in the attainable set, in thrust.
    """
    return np.minimum(trace.thrusts - trace.thrust_min, trace.thrust_max - trace.thrusts).min(axis=1)


#: Figures by name: format and how they are taken.
FIGURES: dict[str, tuple[str, Callable[[Trace], float]]] = {
    "first touch [s]": ("{:.2f}", lambda trace: _least(trace.t[_after_touch(trace)])),
    "greatest push [N]": ("{:.2f}", lambda trace: peak(trace.contact_1khz)),
    "push minus reference, holding, rms [N]": (
        "{:.3f}",
        lambda trace: rms((trace.push_true - trace.push_reference)[_holding(trace)]),
    ),
    "push minus reference, sliding, rms [N]": (
        "{:.3f}",
        lambda trace: rms((trace.push_true - trace.push_reference)[_sliding(trace)]),
    ),
    "height over the row, sliding, rms [mm]": ("{:.2f}", lambda trace: _height_mm(trace, _sliding(trace))),
    "greatest tilt [°]": ("{:.2f}", lambda trace: peak(tilt_deg(trace)[trace.t > 1.0])),
    "change of a thrust per tick in contact, rms [N]": ("{:.3f}", _jitter),
    "further push possible, least in contact [N]": (
        "{:.1f}",
        lambda trace: _least(trace.reach_margin[_after_touch(trace, SETTLED_S)]),
    ),
    "ticks with a limit active [%]": (
        "{:.1f}",
        lambda trace: 100.0 * float(trace.active.any(axis=1).mean()) if trace.active.size else 0.0,
    ),
}


def figures(trace: Trace) -> dict[str, float]:
    """All figures of one flight; NaN where it never came so far."""
    return {name: take(trace) for name, (_, take) in FIGURES.items()}


def comparison_table(comparison: Comparison) -> str:
    """What changed, and the figures of the present, the last and the analytic flight, as markdown."""
    flights = (comparison.now, comparison.last, comparison.analytic)
    columns = [figures(trace) for trace in flights]
    lines = ["| | QP now | QP before | analytic law |", "|:--|--:|--:|--:|"]
    for name, (form, _) in FIGURES.items():
        cells = ("–" if math.isnan(column[name]) else form.format(column[name]) for column in columns)
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    ends = ("" if trace.completed else trace.reason for trace in flights)
    if any(not trace.completed for trace in flights):
        lines.append("| ended by | " + " | ".join(ends) + " |")
    return "\n".join(lines)


def changed_text(comparison: Comparison) -> str:
    """What was changed since the last setting, or why it was refused, as markdown."""
    if comparison.refusal:
        return f"**Refused:** {comparison.refusal}. Shown is the setting before."
    return "**Changed:** " + ("; ".join(comparison.changes) or "nothing yet, this is the shipped preset")
