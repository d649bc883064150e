"""Recorded ticks as C tables: for the self-test and the benchmark of the library."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import VERTICAL, FeatureFrame, LineFeature, Measurement, Reference, SensorFrame
from ibvs_qp.qp.program_code import real, reals
from ibvs_qp.validation.fields import REFERENCE, field_table
from ibvs_qp.validation.measurement import LINES_PER_SLOT

#: Largest difference from the thrusts of Python [N]: in double precision, for rounding by another compiler; in single
#: precision, where row filters carry the rounding of a tick on to the next ones, and there with estimation.
TOLERANCE_N, SINGLE_TOLERANCE_N, SINGLE_FLIGHT_TOLERANCE_N = 1e-6, 0.03, 0.05
#: Kinds of edges as in ``ibvs_edge``.
EDGES = {"board": "IBVS_BOARD_EDGE", "paint": "IBVS_PAINT_EDGE"}

#: Solution and multipliers of a tick.
OtherSolution = tuple[np.ndarray, np.ndarray]


class FlightTick(NamedTuple):
    """One tick of a pilot's flight."""

    frame: SensorFrame
    measurement: Measurement  # of the law
    reference: Reference
    thrusts: np.ndarray  # [N], (n,)
    other: OtherSolution | None = None


def other_solution(controller: Any, command: Command) -> OtherSolution | None:
    """Solution and multipliers of the last tick where Python has them from DAQP.

    They differ from those of the library's active set in their last digits, which decide where OSQP stops within its
    tolerance in the next limited ticks: a replay continues from them.
    """
    if command.outcome is not Outcome.EXACT_FALLBACK:
        return None
    data = controller.engine.data
    found = controller.engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
    return found.x, found.y


def write_recorded(
    folder: Path, config: ControllerConfig, ticks: Sequence[tuple[Measurement, Reference]], single: bool
) -> None:
    """Write ``ibvs_recorded_ticks.c`` and ``.h``: inputs of one flight, and the thrusts of Python.

    Args:
        folder: Folder of the library.
        config: Its configuration.
        ticks: Measurements and references from the start of a flight.
        single: Whether the library's numbers are floats.
    """
    controller, slots = HybridController(config), config.line_slots
    thrusts, others = [], []
    for tick in ticks:
        command = controller.step(*tick)
        thrusts.append(command.thrusts)
        others.append(other_solution(controller, command))
    parts = {
        "measurement ibvs_recorded_measurements": [_measurement(tick[0], slots, single) for tick in ticks],
        "reference ibvs_recorded_references": [_reference(tick[1], slots, single) for tick in ticks],
        "real ibvs_recorded_thrusts": [f"{{{reals(row, single)}}}" for row in thrusts],
    }
    code = ["/* Inputs of a recorded flight, and the thrusts of the Python controller [N]; generated. */"]
    code += ['#include "ibvs_recorded_ticks.h"', ""]
    for name, rows in parts.items():
        second = "[IBVS_ROTORS]" if name.startswith("real") else ""
        code += [f"const ibvs_{name}[IBVS_RECORDED_TICKS]{second} = {{", ",\n".join(rows), "};", ""]
    code += _other_solutions("recorded", others, single)
    (folder / "ibvs_recorded_ticks.c").write_text("\n".join(code))
    tolerance = real(SINGLE_TOLERANCE_N if single else TOLERANCE_N, single)
    (folder / "ibvs_recorded_ticks.h").write_text(_HEADER.format(count=len(ticks), tolerance=tolerance))


def write_flight(folder: Path, config: ControllerConfig, ticks: Sequence[FlightTick], single: bool) -> None:
    """Write ``ibvs_recorded_flight.c`` and ``.h``: inputs of estimation and law from the start of a flight.

    Args:
        folder: Folder of a library with estimation.
        config: Its configuration.
        ticks: The flight.
        single: Whether the library's numbers are floats.
    """
    code = ["/* Recorded flight, and the thrusts of the pilot in Python [N]; generated. */"]
    code += ["#include <stddef.h>", "", '#include "ibvs_recorded_flight.h"', ""]
    rows = []
    for place, tick in enumerate(ticks):
        features = "NULL"
        if tick.frame.features is not None:
            features = f"&features_{place}"
            code.append(
                f"static const ibvs_features features_{place} = {_features(tick.frame.features, config, single)};"
            )
        followed = [line.track_id for line in tick.measurement.lines[: config.line_slots]]
        frame, reference = _frame(tick, single), _reference(tick.reference, config.line_slots, single)
        members = {"frame": frame, "features": features, "reference": reference, "thrusts": tick.thrusts.tolist()}
        rows.append(_structure(single, **members, followed=followed, count=len(followed)))
    code += [
        "",
        "const ibvs_recorded_tick ibvs_recorded_flight[IBVS_RECORDED_FLIGHT_TICKS] = {",
        ",\n".join(rows),
        "};",
        "",
        *_other_solutions("flight", [tick.other for tick in ticks], single),
    ]
    (folder / "ibvs_recorded_flight.c").write_text("\n".join(code))
    tolerance = real(SINGLE_FLIGHT_TOLERANCE_N if single else TOLERANCE_N, single)
    (folder / "ibvs_recorded_flight.h").write_text(_FLIGHT_HEADER.format(count=len(ticks), tolerance=tolerance))


def _other_solutions(name: str, found: Sequence[OtherSolution | None], single: bool) -> list[str]:
    """Table of solutions by tick; the last entry ends it."""
    named = [(tick, *other) for tick, other in enumerate(found) if other is not None]
    rows = [_structure(single, tick=str(tick), x=x, multipliers=y) for tick, x, y in named]
    end = "{.tick = UINT32_MAX}"
    return [f"const ibvs_other_solution ibvs_{name}_others[] = {{", ",\n".join([*rows, end]), "};", ""]


def _frame(tick: FlightTick, single: bool) -> str:
    names = ("stamp_ns", "attitude", "angular_velocity", "specific_force", "wrench", "wrench_stamp_ns")
    limits = {name: getattr(tick.measurement, name) for name in ("thrust_min", "thrust_max")}
    known = {f"has_{name}": value is not None for name, value in limits.items()}
    return _structure(single, **{name: getattr(tick.frame, name) for name in names}, **known, **limits)


def _features(features: FeatureFrame, config: ControllerConfig, single: bool) -> str:
    members = {name: getattr(features, name) for name in ("plane", "curvature", "velocity", "velocity_covariance")}
    known = {f"has_{name}": members[name] is not None for name in ("plane", "velocity")}
    if features.velocity_covariance is not None:
        members["velocity_covariance"] = features.velocity_covariance.ravel()
    lines = [
        _structure(
            single,
            track_id=line.track_id,
            role=line.role == VERTICAL,
            kind=EDGES.get(line.kind),
            surface_side=line.surface_side,
            rho=line.rho,
            theta=line.theta,
            **_variances(line),
            weight=line.weight,
            has_segment=line.segment is not None,
            segment=None if line.segment is None else line.segment.ravel(),
        )
        for line in features.lines[: LINES_PER_SLOT * config.line_slots]
    ]
    stamps = {"stamp_ns": features.stamp_ns, "velocity_stamp_ns": features.velocity_stamp_ns}
    return _structure(single, **stamps, **members, **known, line_count=len(lines), lines=lines)


def _variances(line: LineFeature) -> dict[str, float]:
    (variance, covariance), (_, theta_variance) = line.covariance.tolist()
    return {"variance": variance, "covariance": covariance, "theta_variance": theta_variance}


def _measurement(measurement: Measurement, slots: int, single: bool) -> str:
    rows = field_table(Measurement).rows
    members = {row.name: getattr(measurement, row.name) for row in rows} | {"plane": measurement.plane}
    optional = {row.name for row in rows if row.optional} | {"plane"}
    known = {f"has_{name}": True for name in optional if members[name] is not None}
    stamps = {name: getattr(measurement, name) for name in ("stamp_ns", "wrench_stamp_ns", "plane_stamp_ns")}
    if measurement.velocity_stamp_ns is not None:
        stamps |= {"has_velocity_stamp": True, "velocity_stamp_ns": measurement.velocity_stamp_ns}
    lines = [
        _structure(
            single,
            rho=line.rho,
            theta=line.theta,
            weight=line.weight,
            **_variances(line),
            stamp_ns=line.stamp_ns,
            role=line.role == VERTICAL,
        )
        for line in measurement.lines[: LINES_PER_SLOT * slots]
    ]
    return _structure(single, **stamps, **known, **members, line_count=len(lines), lines=lines)


def _reference(reference: Reference, slots: int, single: bool) -> str:
    members = {row.name: getattr(reference, row.name) for row in REFERENCE.rows}
    lines = [
        _structure(single, rho=line.rho, theta=line.theta, role=line.role == VERTICAL)
        for line in reference.lines[:slots]
    ]
    return _structure(single, **members, contact=reference.contact, line_count=len(lines), lines=lines)


def _structure(single: bool, **members: Any) -> str:
    """Initialiser of a structure; members that are None or zero are left out."""
    named = ((name, value) for name, value in members.items() if value is not None and np.size(value) and np.any(value))
    return "{" + (", ".join(f".{name} = {_literal(value, single)}" for name, value in named) or "0") + "}"


def _literal(value: Any, single: bool) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return "{" + ", ".join(_literal(entry, single) for entry in value) + "}"
    if isinstance(value, float):
        return real(value, single)
    return f"INT64_C({value})" if type(value) is int and abs(value) > 2**31 - 1 else str(int(value))


_HEADER = """/* Recorded flight for self-test and benchmark; generated. */
#ifndef IBVS_RECORDED_TICKS_H
#define IBVS_RECORDED_TICKS_H

#include "ibvs_internal.h"

#define IBVS_RECORDED_TICKS {count}
/* Largest difference from the thrusts of Python [N]. */
#define IBVS_RECORDED_TOLERANCE {tolerance}

extern const ibvs_measurement ibvs_recorded_measurements[IBVS_RECORDED_TICKS];
extern const ibvs_reference ibvs_recorded_references[IBVS_RECORDED_TICKS];
extern const ibvs_real ibvs_recorded_thrusts[IBVS_RECORDED_TICKS][IBVS_ROTORS];
extern const ibvs_other_solution ibvs_recorded_others[]; /* ticks that Python solved with DAQP; the last one ends it */

#endif
"""
_FLIGHT_HEADER = """/* Recorded flight with estimation; generated. */
#ifndef IBVS_RECORDED_FLIGHT_H
#define IBVS_RECORDED_FLIGHT_H

#include "ibvs_estimation.h"
#include "ibvs_internal.h"

#define IBVS_RECORDED_FLIGHT_TICKS {count}
/* Largest difference from the thrusts of Python [N]. */
#define IBVS_RECORDED_FLIGHT_TOLERANCE {tolerance}

typedef struct {{
  ibvs_frame frame;
  const ibvs_features *features; /* of a picture that came with it, or NULL */
  ibvs_reference reference;
  int64_t followed[IBVS_LINES];
  uint32_t count;
  ibvs_real thrusts[IBVS_ROTORS];
}} ibvs_recorded_tick;

extern const ibvs_recorded_tick ibvs_recorded_flight[IBVS_RECORDED_FLIGHT_TICKS];
extern const ibvs_other_solution ibvs_flight_others[]; /* ticks that Python solved with DAQP; the last one ends it */

#endif
"""
