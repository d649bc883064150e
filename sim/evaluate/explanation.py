"""A recorded tick in words: tables of tasks, limits and rotors, what was refused, and the contact loop's margin."""

from __future__ import annotations

import functools
import math
import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.contact_margin import LEAST_DAMPING_RATIO, least_margin
from ibvs_qp.config.settings import from_dict
from ibvs_qp.controller import program_template
from ibvs_qp.model.signals import places
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.qp.explain import Explanation, LimitValue, TickReplay
from ibvs_qp.qp.problem import QpTemplate
from sim.evaluate.explained_limits import conflict_parts, limit_parts, share_of, table_of

if TYPE_CHECKING:
    from sim.flight.trace import Event, Trace

#: Names of rows that only regularise.
_REGULAR = ("effort", "smooth")
_AXES = ("front", "right", "down", "roll", "pitch", "yaw")
#: A force or moment given up that is smaller than this is none [N, N m].
_NOTHING = 5e-4
#: A push this much below what the job asks is told beside it [N].
_REDUCED = 1e-3


@functools.lru_cache(maxsize=2)
def _template(config: ControllerConfig) -> QpTemplate:
    return program_template(config)


def flown_config(trace: Trace) -> PilotConfig:
    """The configuration that a flight was flown with."""
    return from_dict(PilotConfig, tomllib.loads(trace.preset))


def explain_tick(trace: Trace, tick: int, solver: str | None = None) -> tuple[PilotConfig, Explanation | None]:
    """Configuration flown and the explanation of one tick of a QP flight, by the exact solver or a named one."""
    config = flown_config(trace)
    replay = TickReplay(_template(config.controller), solver)
    return config, replay.explain(trace.arrays["program"][tick].astype(float))


def explain_conflict(trace: Trace, tick: int) -> tuple[LimitValue, ...]:
    """A smallest set of hard limits of one tick that contradict each other, as the thrusts flown served them; or ()."""
    replay = TickReplay(_template(flown_config(trace).controller))
    replay.explain(trace.arrays["program"][tick].astype(float))
    return replay.limit_values(replay.conflict, trace.thrusts[tick])


def held(trace: Trace, tick: int) -> bool:
    """Whether the tick answered without a program: the one in its row is that of an earlier tick."""
    return trace.outcomes[int(trace.outcome[tick])] == Outcome.HOLD


def thrust_window(trace: Trace, tick: int, config: PilotConfig) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper thrusts that a tick's program knew: box, deratings and rate limit [N], (n,) each."""
    layout, row = places(_template(config.controller).model.parameters), trace.arrays["program"][tick]
    return row[layout["thrust_lower"]], row[layout["thrust_upper"]]


def refused(trace: Trace, tick: int) -> list[Event]:
    """Inputs refused until this tick, each kind where it was refused first, as the log keeps them."""
    now = float(trace.t[tick]) + 1e-6  # rounding of the time
    return [event for event in trace.events if event.kind == "rejected" and event.t <= now]


def explanation_tables(trace: Trace, tick: int, explanation: Explanation, config: PilotConfig) -> list[Any]:
    """What a person reads: a headline, what was refused, tasks, limits, rotors, wrench given up."""
    headline = _headline(trace, tick, config)
    rotors = _rotors(trace, tick, explanation.thrusts, config)
    parts = [_tasks(explanation), *limit_parts(explanation), rotors, _given_up(explanation.unallocated_wrench)]
    return [headline, *_refused(trace, tick), *parts]


def conflict_tables(trace: Trace, tick: int, conflict: tuple[LimitValue, ...], config: PilotConfig) -> list[Any]:
    """The same for a tick whose hard limits contradict each other: who they are, and what flew instead."""
    parts = [*conflict_parts(conflict), _rotors(trace, tick, None, config), _given_up(trace.unallocated[tick])]
    return [_headline(trace, tick, config), *_refused(trace, tick), *parts]


def held_tables(trace: Trace, tick: int, config: PilotConfig) -> list[Any]:
    """The same for a tick that held: without tasks and limits, because nothing was asked of a program."""
    table = table_of("Thrusts [N]", ("rotor",), ("flown",))
    for name, flew in zip(config.controller.vehicle.geometry.names, trace.thrusts[tick], strict=True):
        table.add_row(name, f"{flew:.3f}")
    words = "The tick held: no program was solved, the thrusts carry the weight and stay level by the last good data."
    return [_headline(trace, tick, config), *_refused(trace, tick), words, table, _given_up(trace.unallocated[tick])]


def _headline(trace: Trace, tick: int, config: PilotConfig) -> str:
    phase, outcome = trace.phases[int(trace.phase[tick])], trace.outcomes[int(trace.outcome[tick])]
    push, given = float(trace.push_measured[tick]), float(trace.push_reference[tick])
    asked, margin = config.painting.push_n, float(trace.reach_margin[tick])
    less = f", {asked:.2f} N by the job before ramp and reach" if 0.0 < given < asked - _REDUCED else ""
    reach = "reach not known, or no push can be held" if math.isnan(margin) else f"{margin:.2f} N further within reach"
    return (
        f"[bold]t = {trace.t[tick]:.3f} s[/], phase {phase}, lambda {trace.contact_weight[tick]:.2f}\n"
        f"push {push:.2f} N of {given:.2f} N asked{less}; {reach}\n"
        f"{outcome} after {int(trace.iterations[tick])} iterations"
    )


def _refused(trace: Trace, tick: int) -> list[str]:
    return [f"Refused at {event.t:.3f} s: {event.text}" for event in refused(trace, tick)]


def _tasks(explanation: Explanation) -> Any:
    columns = ("task", "unit"), ("asked", "does", "residual", "weight", "cost")
    table, quiet = table_of("Tasks: what was asked, what the program does", *columns), 0.0
    for task, cost in zip(explanation.tasks, explanation.cost, strict=True):
        if task.name.startswith(_REGULAR):
            quiet += cost
            continue
        values = (f"{value:+.4f}" for value in (task.asked, task.achieved, task.residual))
        table.add_row(task.name, task.unit, *values, f"{task.weight:.4g}", share_of(cost))
    table.add_row("effort, smoothness", "N", "", "", "", "", share_of(quiet))
    return table


def _rotors(trace: Trace, tick: int, exact: np.ndarray | None, config: PilotConfig) -> Any:
    columns = {"flown": trace.thrusts[tick]} | ({} if exact is None else {"exact": exact})
    columns |= dict(zip(("from", "to"), thrust_window(trace, tick, config), strict=True))
    table = table_of("Thrusts [N]", ("rotor",), tuple(columns))
    for name, *numbers in zip(config.controller.vehicle.geometry.names, *columns.values(), strict=True):
        table.add_row(name, *(f"{number:.3f}" for number in numbers))
    return table


def _given_up(lost: np.ndarray) -> str:
    units = ("N",) * 3 + ("N m",) * 3
    told = [entry for entry in zip(_AXES, lost.tolist(), units, strict=True) if abs(entry[1]) >= _NOTHING]
    if not told:
        return "Nothing was given up."
    parts = (f"{name} {value:+.3f} {unit}" for name, value, unit in told)
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
