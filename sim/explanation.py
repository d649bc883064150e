"""A recorded tick in words: tables of tasks, limits and rotors, and the contact loop's margin."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np

from allocation.geometry import TAROT_T960
from ibvs_qp.controller import program_template
from ibvs_qp.loop_margin import LEAST_DAMPING_RATIO, least_margin
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.qp.replay import Explanation, TickReplay
from ibvs_qp.settings import from_dict

if TYPE_CHECKING:
    from sim.trace import Trace

#: Names of rows that only regularise.
_REGULAR = ("effort", "smooth")
_AXES = ("front", "right", "down", "roll", "pitch", "yaw")


def explain_tick(trace: Trace, tick: int, solver: str | None = None) -> tuple[PilotConfig, Explanation | None]:
    """Configuration flown and the explanation of one tick of a QP flight, by the exact solver or a named one."""
    config = from_dict(PilotConfig, tomllib.loads(trace.preset))
    replay = TickReplay(program_template(config.controller), solver)
    return config, replay.explain(trace.arrays["program"][tick].astype(float))


def explanation_tables(trace: Trace, tick: int, explanation: Explanation) -> list[Any]:
    """What a person reads: a headline, tasks, limits, rotors, wrench given up."""
    phase, outcome = trace.phases[int(trace.phase[tick])], trace.outcomes[int(trace.outcome[tick])]
    push, asked = float(trace.push_measured[tick]), float(trace.push_reference[tick])
    headline = (
        f"[bold]t = {trace.t[tick]:.3f} s[/], phase {phase}, lambda {trace.contact_weight[tick]:.2f}\n"
        f"push {push:.2f} N of {asked:.2f} N asked; {outcome} after {int(trace.iterations[tick])} iterations"
    )
    rotors = _rotors(trace, tick, explanation)
    return [headline, _tasks(explanation), _limits(explanation), rotors, _given_up(explanation)]


def _table(title: str, words: tuple[str, ...], numbers: tuple[str, ...], last: tuple[str, ...] = ()) -> Any:
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for column in (*words, *numbers, *last):
        table.add_column(column, justify="right" if column in numbers else "left", no_wrap=True)
    return table


def _tasks(explanation: Explanation) -> Any:
    columns = ("task", "unit"), ("asked", "does", "residual", "weight", "cost")
    table, quiet = _table("Tasks: what was asked, what the program does", *columns), 0.0
    for task, cost in zip(explanation.tasks, explanation.cost, strict=True):
        if task.name.startswith(_REGULAR):
            quiet += cost
            continue
        values = (f"{value:+.4f}" for value in (task.asked, task.achieved, task.residual))
        table.add_row(task.name, task.unit, *values, f"{task.weight:.4g}", f"{cost:.0%}")
    table.add_row("effort, smoothness", "N", "", "", "", "", f"{quiet:.0%}")
    return table


def _limits(explanation: Explanation) -> Any:
    if not explanation.active_limits:
        return "No limit is active: the thrusts are the weighted least-squares law."
    table = _table("Active limits; price = |d cost / d bound|", ("limit", "side"), ("price", "slack"), ("unit",))
    for limit in explanation.active_limits:
        table.add_row(limit.name, limit.side, f"{limit.price:.4g}", f"{limit.slack:.4g}", limit.unit)
    return table


def _rotors(trace: Trace, tick: int, explanation: Explanation) -> Any:
    count = len(explanation.thrusts)
    names = TAROT_T960.names if TAROT_T960.count == count else tuple(f"rotor {i + 1}" for i in range(count))
    table = _table("Thrusts [N]", ("rotor",), ("flown", "exact", "from", "to"))
    rows = zip(names, trace.thrusts[tick], explanation.thrusts, trace.thrust_min, trace.thrust_max, strict=True)
    for name, flew, exact, low, high in rows:
        table.add_row(name, f"{flew:.3f}", f"{exact:.3f}", f"{low:g}", f"{high:g}")
    return table


def _given_up(explanation: Explanation) -> str:
    lost = explanation.unallocated_wrench
    if not np.any(np.abs(lost) > 1e-6):
        return "Nothing was given up."
    units = ("N",) * 3 + ("N m",) * 3
    parts = (f"{name} {value:+.3f} {unit}" for name, value, unit in zip(_AXES, lost, units, strict=True))
    return "Given up to the limits: " + ", ".join(parts)


def loop_margin_line(config: PilotConfig) -> str:
    """Least damping of the contact mode over the stiffness range of the preset's brush."""
    brush = config.controller.brush
    margin = least_margin(config.controller, brush)
    return (
        f"Contact loop: least damping ratio {margin.least_damping_ratio:.2f} at {margin.frequency_hz:.1f} Hz and "
        f"{margin.stiffness_n_m:.0f} N/m (brush {brush.stiffness_min_n_m:g} to {brush.stiffness_max_n_m:g} N/m; "
        f"presets below {LEAST_DAMPING_RATIO:g} are refused)"
    )
