"""Page, table and summary of the fault matrix; every number comes from the table of flights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import polars as pl

from allocation import WrenchFacets, least_hover_tilt
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.evaluate.table import markdown
from sim.fault_matrix.verdict import (
    ADVANCE_M,
    LEAVE_S,
    PUSH_N,
    PUSH_RATIO,
    SPEED_M_S,
    TILT_CONTACT_DEG,
    TILT_DEG,
    Tally,
    Verdict,
)
from sim.faults.fault import Fault
from sim.faults.rotors import RotorFault
from sim.faults.scenario import WATCH_S, Scenario
from sim.report.rundir import write_json
from sim.sweep.parts import write_table
from sim.world.errors import RotorErrors
from sim.world.scene import Scene
from sim.world.true_vehicle import TrueVehicle, true_vehicle


@dataclass(frozen=True, kw_only=True)
class Hover:
    """Least tilt of a hover after a fault [deg], over all rotors that it may hit; inf without one."""

    row: str
    world: str
    turning: float  # the vehicle may turn about its vertical axis
    heading: float  # it must not


def hovers(rows: Sequence[Scenario], scenes: dict[str, Scene], nominal: VehicleParams) -> list[Hover]:
    """The hover that is left by every row with a fault of rotors.

    Args:
        rows: Rows of the matrix.
        scenes: Scene of every world, by name.
        nominal: Vehicle of the controller.
    """
    facets, names, found = WrenchFacets(nominal.geometry), nominal.geometry.names, []
    for row in rows:
        if not all(isinstance(fault, RotorFault) for fault in row.faults):
            continue
        place = next(iter(row.places))
        hit = {row.flown(place, seed, names) for seed in range(len(names))}
        for world, scene in scenes.items():
            vehicle = true_vehicle(scene, nominal)
            tilts = [_tilts(facets, vehicle, scene.errors.rotors, faults) for faults in hit]
            turning, heading = (max(values) for values in zip(*tilts, strict=True))
            found.append(Hover(row=row.name, world=world, turning=turning, heading=heading))
    return found


def _tilts(
    facets: WrenchFacets, vehicle: TrueVehicle, errors: RotorErrors, faults: Sequence[Fault]
) -> tuple[float, float]:
    """Least tilt of a hover that may turn, and of one that keeps its heading [deg]."""
    lower, upper = limits_after(vehicle, 1.0 + errors.gain, faults)
    weight = vehicle.mass_kg * GRAVITY
    turning, heading = (
        least_hover_tilt(facets, weight, lower, upper, centre=vehicle.com_offset_m, hold_yaw=held)
        for held in (False, True)
    )
    return turning, heading


def limits_after(vehicle: TrueVehicle, gain: float, faults: Sequence[Fault]) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest true thrust of every rotor under faults [N], (n,) each.

    Args:
        vehicle: The true vehicle.
        gain: Mean of true over commanded thrust in its world; the spread over rotors averages out in the lift.
        faults: Faults of rotors.
    """
    lower, upper = (np.array(side, float) for side in (vehicle.thrust_min, vehicle.thrust_max))
    rotors = SimpleNamespace(
        vehicle=vehicle, thrust_limits=(lower, upper), gain=gain * np.broadcast_to(vehicle.thrust_gain, lower.shape)
    )
    for fault in faults:
        fault.strike(cast(Any, SimpleNamespace(plant=rotors)), cast(Any, SimpleNamespace()))
    low, high = rotors.thrust_limits
    # The plant scales a command and then limits it.
    return np.clip(rotors.gain * lower, low, high), np.clip(rotors.gain * upper, low, high)


def in_words(tilt: float) -> str:
    """A tilt for the table."""
    return "none" if math.isinf(tilt) else f"{tilt:.1f}"


#: Most failures that are listed for a row at a place.
LISTED = 3
_CRITERIA = """\
A flight passes when no exception is raised; the thrusts of every tick are finite, within {low:g} to {high:g} N, and
change by at most {rate:g} N/s; the vehicle does not crash (a slow level touchdown is a landing); by the truth its tilt
stays within {tilt:g} deg ({contact:g} in contact) unless a rotor is lost, its push at 1 kHz within {ratio:g} times the
reference and {push:g} N, its speed within {speed:g} m/s; the expected state is reached in time, every change of state
has a reason, a job that must be completed is, and a vehicle that must retreat has left the wall {leave:g} s after the
latest begin of the retreat and advanced by at most {advance:g} m. The flight goes on for {watch:g} s after the fault,
independent of the strategy.
"""
_LEGEND = """\
*place*: in contact in the middle of the stroke, or free on the way to the wall. *passed*: flights with the supervisor.
Tilt, push, speed and the time from the fault to the retreat are the worst of these flights (of the control flights
where none was flown). *state*: most severe states reached. *control fails*: flights without the supervisor that break a
criterion, and which; **bold** where they must and do not. †: no law could save the vehicle; only commands and states
are scored.
"""
_BORNE = """\
The other {borne} need not: there validation, estimation, the law or the strategy tolerates the fault. They do not show
that the supervisor is needed."""
_ATTAINABLE = """\
Least tilt at which the rotors carry the weight with no roll and pitch moment, by the facets of the attainable wrench
set (`allocation/hover.py`), for the worst rotor. Without one up to 60 deg, no law can hold the vehicle in
the air.
"""
_HEADS = ("fault", "place", "passed", "tilt deg", "push N", "speed m/s", "retreat s", "state", "control fails", "by")
#: Columns of `_HEADS` that hold words.
_TEXT = (0, 1, 7, 9)


def page(verdicts: Sequence[Verdict], hovers: Sequence[Hover], lead: str, command: str, vehicle: VehicleParams) -> str:
    """Markdown text of the page.

    Args:
        verdicts: The rows.
        hovers: Remaining hovers after faults of rotors.
        lead: A sentence on the flights.
        command: Command that repeats it.
        vehicle: Limits of the thrusts.
    """
    text = (
        f"# Results of the fault matrix\n\n"
        f"Generated from data by `{command}` (`sim/fault_matrix`); do not edit. {lead}\n\n"
        f"{_criteria(vehicle)}\n## Verdict\n\n{_summary(verdicts)}\n## Rows\n\n{_LEGEND}\n{_table(verdicts)}"
    )
    chapters = {
        "Flights that failed": _failures(verdicts),
        "Rows that prove nothing": _idle(verdicts),
        "Remaining actuation": _hovers(hovers, verdicts),
    }
    return text + "".join(f"\n## {title}\n\n{chapter}" for title, chapter in chapters.items() if chapter)


def _criteria(vehicle: VehicleParams) -> str:
    return _CRITERIA.format(
        low=float(vehicle.thrust_min[0]),
        high=float(vehicle.thrust_max[0]),
        rate=vehicle.thrust_rate_n_s,
        tilt=TILT_DEG,
        contact=TILT_CONTACT_DEG,
        ratio=PUSH_RATIO,
        push=PUSH_N,
        speed=SPEED_M_S,
        leave=LEAVE_S,
        advance=ADVANCE_M,
        watch=WATCH_S,
    )


def _summary(verdicts: Sequence[Verdict]) -> str:
    flown = [verdict for verdict in verdicts if verdict.flown.n]
    must = [verdict for verdict in verdicts if verdict.expected.control_fails and verdict.control.n]
    lines = []
    if flown:
        flights, passed = sum(each.flown.n for each in flown), sum(each.flown.passed for each in flown)
        met = sum(each.met for each in flown)
        lines.append(f"With the supervisor {met} of {len(flown)} rows pass ({passed} of {flights} flights).")
    if must:
        proved = sum(not each.proves_nothing for each in must)
        lines.append(f"Without it {proved} of the {len(must)} rows that must fail do.")
    if borne := sum(not verdict.expected.control_fails and verdict.control.n > 0 for verdict in verdicts):
        lines.append(_BORNE.format(borne=borne))
    return " ".join(lines) + "\n"


def _table(verdicts: Sequence[Verdict]) -> str:
    return markdown(_HEADS, [_row(verdict) for verdict in verdicts], left=_TEXT)


def _row(verdict: Verdict) -> tuple[str, ...]:
    flown, control = verdict.flown, verdict.control
    shown = flown if flown.n else control
    passed = f"{flown.passed}/{flown.n}" if flown.n else "–"
    fails = f"{control.n - control.passed}/{control.n}" if control.n else "–"
    return (
        verdict.row.name + (" †" if verdict.row.beyond else ""),
        verdict.place,
        passed if verdict.met else f"**{passed}**",
        *(_number(shown.worst[name], 1) for name in ("tilt_peak_deg", "push_peak_n")),
        _number(shown.worst["speed_peak_m_s"], 2),
        _number(shown.retreat_s, 2),
        ", ".join(flown.states),
        f"**{fails}**" if verdict.proves_nothing else fails,
        "; ".join(control.how[:LISTED]),
    )


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"


def _failures(verdicts: Sequence[Verdict]) -> str:
    lines = []
    for verdict in verdicts:
        for world, seed, criteria in verdict.flown.failures[:LISTED]:
            failed = "; ".join(criterion.text for criterion in criteria)
            lines.append(f"- {verdict.row.name}, {verdict.place}, {world}, seed {seed}: {failed}\n")
        if (more := len(verdict.flown.failures) - LISTED) > 0:
            lines.append(f"- {verdict.row.name}, {verdict.place}: {more} more\n")
    return "".join(lines)


def _idle(verdicts: Sequence[Verdict]) -> str:
    idle = [verdict for verdict in verdicts if verdict.proves_nothing]
    if not idle:
        return ""
    lines = (f"- {verdict.row.name}, {verdict.place} ({_ends(verdict.control)})\n" for verdict in idle)
    return "Their control flights must fail, and pass:\n\n" + "".join(lines)


def _ends(tally: Tally) -> str:
    return "; ".join(tally.ends)


def _hovers(hovers: Sequence[Hover], verdicts: Sequence[Verdict]) -> str:
    if not hovers:
        return ""
    rows = [(hover.row, hover.world, in_words(hover.turning), in_words(hover.heading)) for hover in hovers]
    heads = ("fault", "world", "least tilt, may turn, deg", "least tilt, heading held, deg")
    beyond = {verdict.row.name: verdict.row.beyond for verdict in verdicts if verdict.row.beyond}
    reasons = "".join(f"\n† {name}: {reason}.\n" for name, reason in beyond.items())
    return f"{_ATTAINABLE}\n{markdown(heads, rows, left=range(2))}{reasons}"


SCHEMA = 1
#: Folder of the parts, table of all flights, page, summary.
PARTS, TABLE, PAGE, SUMMARY = "parts", "faults.parquet", "faults.md", "faults.json"


def summary(verdicts: Sequence[Verdict], folder: Path, facts: dict[str, Any]) -> dict[str, Any]:
    """Content of the summary and of ``--json``.

    Args:
        verdicts: The rows.
        folder: Folder of the run.
        facts: Of the flights: command, version, seed and so on.
    """
    flown = [verdict for verdict in verdicts if verdict.flown.n]
    return {
        "schema": SCHEMA,
        "name": "faults",
        **facts,
        "run_dir": str(folder),
        "data_file": str(folder / TABLE),
        "rows_met": sum(verdict.met for verdict in flown),
        "rows_flown": len(flown),
        "proves_nothing": [[verdict.row.name, verdict.place] for verdict in verdicts if verdict.proves_nothing],
        "rows": [
            {
                "fault": verdict.row.name,
                "place": verdict.place,
                "met": verdict.met if verdict.flown.n else None,
                "beyond": verdict.row.beyond or None,
                "supervised": _entry(verdict.flown),
                "control": _entry(verdict.control),
                "control_must_fail": verdict.expected.control_fails,
            }
            for verdict in verdicts
        ],
    }


def _entry(tally: Tally) -> dict[str, Any]:
    return {
        "n": tally.n,
        "passed": tally.passed,
        **tally.worst,
        "retreat_s": tally.retreat_s,
        "states": list(tally.states),
        "failures": [
            {"world": world, "seed": seed, "criteria": [criterion.text for criterion in criteria]}
            for world, seed, criteria in tally.failures
        ],
    }


def write(folder: Path, table: pl.DataFrame, content: dict[str, Any], text: str) -> Path:
    """Write table, summary and page; returns the page's file."""
    write_table(folder / TABLE, table)
    write_json(folder / SUMMARY, content)
    file = folder / PAGE
    file.write_text(text, encoding="utf-8")
    return file
