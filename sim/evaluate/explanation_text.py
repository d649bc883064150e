"""Text and tables of `ibvs-qp explain`: headline, rejected inputs, tasks, limits, rotors, unallocated wrench."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config.contact_margin import LEAST_DAMPING_RATIO, least_margin
from ibvs_qp.pilot import PilotConfig
from sim.evaluate.explanation import push_reduction, rejections, thrust_window, trim_tilt
from sim.evaluate.table import plain, terminal_table

if TYPE_CHECKING:
    from ibvs_qp.qp.explain import Explanation, LimitValue
    from sim.flight.trace import Trace

#: Names of task rows that only regularise.
_REGULAR = ("effort", "smooth")
#: Headings of the table of tasks.
TASK_HEADINGS = ("task", "unit", "target", "achieved", "residual", "weight", "cost")
_AXES = ("front", "right", "down", "roll", "pitch", "yaw")
#: Components of the unallocated wrench below this are not listed [N, N m].
_NOTHING = 5e-4
#: A commanded push that is lower than the job's by more than this is explained [N].
_REDUCED_N = 1e-3
#: Rows without a limit at this tick have bounds beyond this, in the row's unit.
_NO_BOUND = 9e3
#: Angles of a trim below this are not shown [deg].
_NO_TRIM_DEG = 0.05
#: Noise clipped at the limits below this is not mentioned [N].
_NOISE_N = 5e-3
#: Violations of a limit below this are rounding, in the row's unit.
_ROUNDING = 1e-6


def explanation_tables(
    trace: Trace,
    tick: int,
    explanation: Explanation | None,
    config: PilotConfig,
    conflict: tuple[LimitValue, ...] = (),
) -> list[Any]:
    """Strings and tables for a console: a solved tick, one with conflicting hard limits, or a hold with neither."""
    rotors = _rotors(trace, tick, config, explanation, bool(explanation or conflict))
    if explanation is not None:
        parts = [_tasks(explanation), *_limits(explanation), rotors, _unallocated(explanation.unallocated_wrench)]
    elif conflict:
        parts = [*_conflict(conflict), rotors, _unallocated(trace.unallocated[tick])]
    else:
        parts = [
            "Outcome hold: no program was solved; the thrusts carry the weight and level the vehicle by IMU data.",
            *(rotors, _unallocated(trace.unallocated[tick])),
        ]
    return [*_headline(trace, tick, config), *parts, _loop_margin(config)]


def _headline(trace: Trace, tick: int, config: PilotConfig) -> list[str]:
    """Time, phase, push asked, commanded and measured, and outcome; then the rejected inputs."""
    phase, outcome = trace.phases[int(trace.phase[tick])], trace.outcomes[int(trace.outcome[tick])]
    push, reference = float(trace.push_measured[tick]), float(trace.push_reference[tick])
    job, margin = config.painting.push_n, float(trace.reach_margin[tick])
    reason = push_reduction(trace, tick) or "by the ramp after touch"
    lowered = f" (reduced: {plain(reason)})" if 0.0 < reference < job - _REDUCED_N else ""
    reach = "reach unknown, or no push can be held" if math.isnan(margin) else f"{margin:.2f} N further within reach"
    headline = (
        f"[bold]t = {trace.t[tick]:.3f} s[/], phase {plain(phase)}, lambda {trace.contact_weight[tick]:.2f}\n"
        f"push asked {job:.2f} N, commanded {reference:.2f} N, measured {push:.2f} N{lowered}; {reach}\n"
        f"{plain(outcome)} after {int(trace.iterations[tick])} iterations"
    )
    return [
        headline,
        *_trim(trace, tick, config),
        *(f"Rejected at {event.t:.3f} s: {plain(event.text)}" for event in rejections(trace, tick)),
    ]


def _trim(trace: Trace, tick: int, config: PilotConfig) -> list[str]:
    """Deliberate tilt and the push that it buys."""
    held = trace.outcomes[int(trace.outcome[tick])] == Outcome.HOLD
    trim = None if held else trim_tilt(trace, tick, config)
    if trim is None or max(abs(trim.roll_deg), abs(trim.pitch_deg)) < _NO_TRIM_DEG:
        return []
    gain = trim.reach_n - trim.level_reach_n
    return [
        f"Trim: {trim.roll_deg:+.1f} deg of roll and {trim.pitch_deg:+.1f} deg of pitch, at most "
        f"{config.controller.limits.trim_deg:g} deg each, buy {gain:.1f} N of reach: {trim.reach_n:.1f} N at this "
        f"attitude, {trim.level_reach_n:.1f} N level"
    ]


def task_rows(explanation: Explanation) -> list[tuple[str, ...]]:
    """Cells under `TASK_HEADINGS` of every task; the last row sums up the rows that only regularise."""
    rows, regular = [], 0.0
    for task, cost in zip(explanation.tasks, explanation.cost, strict=True):
        if task.name.startswith(_REGULAR):
            regular += cost
            continue
        values = (f"{value:+.4f}" for value in (task.asked, task.achieved, task.residual))
        rows.append((task.name, task.unit, *values, f"{task.weight:.4g}", _percent(cost)))
    return [*rows, ("effort, smoothness", "N", "", "", "", "", _percent(regular))]


def _tasks(explanation: Explanation) -> Any:
    return terminal_table(TASK_HEADINGS, task_rows(explanation), "Tasks", text=("task", "unit"))


def _limits(explanation: Explanation) -> list[Any]:
    noise = float(np.abs(explanation.clipped).max())
    clipped = f"Noise of up to {noise:.2f} N is clipped at the limits of the thrusts." if noise >= _NOISE_N else ""
    if not explanation.active_limits:
        return [f"No limit is active: the thrusts are the weighted least-squares solution. {clipped}".rstrip()]
    rows, prices = [], []
    every = (explanation.active_limits, explanation.limit_rows, explanation.limit_cost, explanation.limit_ranges)
    for limit, row, cost, span in zip(*every, strict=True):
        bound = row.upper if limit.side == "upper" else row.lower
        slack, paid = "", "hard"
        if limit.slack > 0.0:
            slack, paid = f"{limit.slack:.4g}", f"{cost * explanation.total_cost:.3g} ({_percent(cost)})"
        rows.append((limit.name, limit.side, _number(bound), _number(row.value), slack, limit.unit, paid))
        fall = f"{span.cost_fall:.3g} ({_percent(span.cost_fall / explanation.total_cost)})"
        changes = f"{span.change_low:+.3g} to {span.change_high:+.3g}"
        prices.append((limit.name, _number(limit.price), limit.unit, changes, fall, span.until))
    words = (
        "Price: the derivative of the program's cost by the bound, the multiplier. It falls as the bound yields, so "
        "the cost falls by less than price times change: by the amount stated if the bound yields to the end of the "
        "range. Over the range the same limits are active; at its end a limit is released or becomes active. "
    )
    if explanation.slack_cost > 0.0:
        words += f"Slack takes {_percent(explanation.slack_cost)} of the cost of {explanation.total_cost:.3g}. "
    words += f"The cost has no unit: weights and slack weights are per squared unit of the row. {clipped}".rstrip()
    headings = ("limit", "side", "bound", "value", "slack", "unit", "cost of slack")
    title = "Active limits, highest price first"
    price_headings = ("limit", "price per unit", "unit", "range of changes", "cost falls by", "until")
    price_text = ("limit", "unit", "until")
    return [
        terminal_table(headings, rows, title, text=("limit", "side", "unit")),
        terminal_table(price_headings, prices, "Derivatives of the cost by these bounds", text=price_text),
        words,
    ]


def _conflict(conflict: tuple[LimitValue, ...]) -> list[Any]:
    words = (
        f"[bold]No thrusts satisfy these {len(conflict)} hard limits together[/]; without any one of them a solution "
        "exists. The analytic law had control, clipped to the rotors' limits."
    )
    rows = []
    for row in conflict:
        violation = max(row.lower - row.value, row.value - row.upper)
        text = f"{violation:.4g}" if violation > _ROUNDING else "satisfied"
        rows.append((row.name, _number(row.lower), _number(row.upper), _number(row.value), text, row.unit))
    headings = ("limit", "from", "to", "flown", "violation", "unit")
    advice = "With limits.hard_barriers = false the barriers have slack weights, and a solution always exists."
    return [words, terminal_table(headings, rows, "Limits in conflict", text=("limit", "unit")), advice]


def _rotors(trace: Trace, tick: int, config: PilotConfig, explanation: Explanation | None, window: bool) -> Any:
    """Thrusts flown, those of the exact solution if there is one, and the thrust limits if there was a program."""
    columns = {"flown": trace.thrusts[tick]} | ({} if explanation is None else {"exact": explanation.thrusts})
    if window:
        columns["from"], columns["to"] = thrust_window(trace, tick, config)
    names = config.controller.vehicle.geometry.names
    rows = [(name, *(f"{x:.3f}" for x in thrusts)) for name, *thrusts in zip(names, *columns.values(), strict=True)]
    return terminal_table(("rotor", *columns), rows, "Thrusts [N]")


def _loop_margin(config: PilotConfig) -> str:
    """Smallest damping ratio of the contact mode over the stiffness range of the preset's brush."""
    brush = config.controller.brush
    margin = least_margin(config.controller, brush)
    return (
        f"Contact loop: smallest damping ratio {margin.least_damping_ratio:.2f} at {margin.frequency_hz:.1f} Hz and "
        f"{margin.stiffness_n_m:.0f} N/m (brush {brush.stiffness_min_n_m:g} to {brush.stiffness_max_n_m:g} N/m; "
        f"presets below {LEAST_DAMPING_RATIO:g} are rejected)"
    )


def _unallocated(wrench: np.ndarray) -> str:
    units = ("N",) * 3 + ("N m",) * 3
    lost = [entry for entry in zip(_AXES, wrench.tolist(), units, strict=True) if abs(entry[1]) >= _NOTHING]
    if not lost:
        return "The whole wrench is allocated."
    return "Wrench that the limits leave unallocated: " + ", ".join(
        f"{name} {value:+.3f} {unit}" for name, value, unit in lost
    )


def _percent(fraction: float) -> str:
    return "<1%" if 0.0 < fraction < 0.005 else f"{fraction:.0%}"


def _number(value: float) -> str:
    return "none" if abs(value) > _NO_BOUND else f"{value:.4g}"
