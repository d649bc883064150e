"""Sizes, places, constants and tables of the C library, from the declarations that Python uses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from allocation import DEFAULT_ROW_WEIGHTS, control_effectiveness
from ibvs_qp.analytic import RANK_TOLERANCE
from ibvs_qp.config import Gains
from ibvs_qp.config.field_of_view import camera_rotation
from ibvs_qp.frames import GRAVITY
from ibvs_qp.interfaces.c_library.tick_code import TickCode
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.hover import hover_gains
from ibvs_qp.model.setpoints import ANY_STEP
from ibvs_qp.model.tick import LINE
from ibvs_qp.qp.problem import QpProblem
from ibvs_qp.qp.program_code import real, reals, table
from ibvs_qp.symbolic.signals import places
from ibvs_qp.validation import clock, geometry
from ibvs_qp.validation.fields import REFERENCE, UNIT_TOLERANCE, FieldTable, field_table
from ibvs_qp.validation.measurement import LINES_PER_SLOT, OLDEST_LINE_NS

GAINS = fields(Gains)
#: Bits of rejected inputs, by kind of input or field, that are not the field's name.
REJECTIONS = {"reference": "REFERENCE", "wrench": "CONTACT_WRENCH"}


def write_layout(folder: Path, problem: QpProblem, tick: TickCode, single: bool) -> None:
    """Write ``ibvs_layout.h``: sizes, times [ns], constants, gains, and places of the inputs and results."""
    config, vehicle, function = problem.model.config, problem.model.config.vehicle, tick.function
    hover_kp, hover_kd = hover_gains(config)
    sizes = {
        "LINES": config.line_slots,
        "MOST_LINES": LINES_PER_SLOT * config.line_slots,
        "LINE_ENTRIES": len(LINE),
        "INPUTS": function.numel_in(0),
        "STATES": function.numel_in(1),
        "RESULTS": function.numel_out(2),
        "GAINS": len(GAINS),
        "MEASUREMENT_FIELDS": len(field_table(Measurement, vehicle.geometry.count).rows),
        "REFERENCE_FIELDS": len(REFERENCE.rows),
        "RECOVERY_TICKS": config.solver.recovery_ticks,
        "RESTART_STAMPS": clock.RESTART_STAMPS,
        "TURNED_CAMERA": int(any(vehicle.camera_turn_deg)),
        "UNIQUE_THRUSTS": int(np.linalg.matrix_rank(control_effectiveness(vehicle.geometry)) == problem.model.rotors),
    }
    times = {name: getattr(clock, name) for name in ("STAMP_END", "JUMP_NS", "RESTART_NS", "LEAD_NS")}
    times["OLDEST_LINE_NS"] = OLDEST_LINE_NS
    constants = {
        "TICK_S": config.tick_s,
        "MASS_KG": vehicle.mass_kg,
        "GRAVITY": GRAVITY,
        "HOVER_KP": hover_kp,
        "HOVER_KD": hover_kd,
        "RATE_STEP": vehicle.thrust_rate_n_s * config.tick_s,
        "ANY_STEP": ANY_STEP,
        "RANK_TOLERANCE": RANK_TOLERANCE,
        "UNIT_TOLERANCE": UNIT_TOLERANCE,
    }
    for name in ("LINE_BOUND", "VARIANCE_BOUND", "INVERSE_DEPTH_BOUND", "INVERSE_DEPTH_MIN"):
        constants[name] = getattr(geometry, name)
    starts = places(tick.signals.inputs)
    starts["gains"] = slice(starts[f"gains.{GAINS[0].name}"].start, 0)
    lines = [
        "/* Sizes, places and constants of this configuration; generated. */",
        "#ifndef IBVS_LAYOUT_H",
        "#define IBVS_LAYOUT_H",
        "",
        '#include "ibvs_program_layout.h"',
        "",
        *(f"#define IBVS_{name} {value}" for name, value in sizes.items()),
        *(f"#define IBVS_{name} INT64_C({value})" for name, value in times.items()),
        *(f"#define IBVS_{name} {real(value, single)}" for name, value in constants.items()),
        f"#define IBVS_FIRST_GAIN {GAINS[0].name}",
        "",
        "/* Gains; each within its range. */",
        "typedef struct {",
        *(f"  ibvs_real {field.name}; /* {_explained(field.metadata)} */" for field in GAINS),
        "} ibvs_gains;",
        "",
        "/* Places of the inputs and results. */",
        *enumeration("IN", starts),
        *enumeration("OUT", places(tick.signals.outputs)),
        "#endif",
        "",
    ]
    (folder / "ibvs_layout.h").write_text("\n".join(lines))


def _explained(metadata: Mapping[str, Any]) -> str:
    unit = f" [{metadata['unit']}]" if metadata.get("unit") else ""
    return f"{metadata['doc']}{unit}, {metadata['low']:g} to {metadata['high']:g}"


def enumeration(prefix: str, starts: Mapping[str, slice]) -> list[str]:
    """Lines of an enumeration of first places, ``IBVS_PREFIX_NAME``."""
    entries = (f"  IBVS_{prefix}_{_capitals(name)} = {place.start}" for name, place in starts.items())
    return ["enum {", ",\n".join(entries), "};", ""]


def _capitals(name: str) -> str:
    return name.replace(".", "_").upper()


def write_tables(folder: Path, problem: QpProblem, tick: TickCode, single: bool) -> None:
    """Write ``ibvs_tables.c``: bounds of the inputs, start values and vehicle."""
    config, signals = problem.model.config, tick.signals
    vehicle, first = config.vehicle, Reference()
    effectiveness, measurements = (
        control_effectiveness(vehicle.geometry),
        field_table(Measurement, vehicle.geometry.count),
    )
    before = [f".{row.name} = {{{reals(row.fallback, single)}}}" for row in measurements.rows if row.fallback]
    asked = [f".{name} = {real(getattr(first, name), single)}" for name in ("push_force", "standoff")]
    gains = {
        "default": [getattr(config.gains, field.name) for field in GAINS],
        "least": [field.metadata["low"] for field in GAINS],
        "largest": [field.metadata["high"] for field in GAINS],
    }
    arrays = {
        "start_states": np.concatenate([signals.starts[name] for name in signals.states]),
        "thrust_floor": vehicle.thrust_min,
        "thrust_ceiling": vehicle.thrust_max,
        "effectiveness": effectiveness,
        "inverse": np.linalg.pinv(effectiveness),
        "mass_matrix": vehicle.mass_matrix,
        "allocation_weights": DEFAULT_ROW_WEIGHTS,
        "camera_turn": camera_rotation(vehicle.camera_turn_deg),
    }
    lines = [
        "/* Bounds of the inputs, start values and vehicle; generated. */",
        '#include "ibvs_internal.h"',
        "",
        *field_rows("measurement", measurements, single),
        *field_rows("reference", REFERENCE, single),
        f"const ibvs_measurement ibvs_first_measurement = {{{', '.join(before)}}};",
        f"const ibvs_reference ibvs_first_reference = {{{', '.join(asked)}}};",
        *(f"const ibvs_gains ibvs_{name}_gains = {{{reals(values, single)}}};" for name, values in gains.items()),
        *(table("ibvs_real", f"ibvs_{name}", values, single) for name, values in arrays.items()),
        "",
    ]
    (folder / "ibvs_tables.c").write_text("\n".join(lines))


def field_rows(kind: str, fields: FieldTable, single: bool) -> list[str]:
    """The rows of `ibvs_qp.validation.fields` as those of ``ibvs_field``."""
    rows = []
    for field in fields.rows:
        entries = (
            f"offsetof(ibvs_{kind}, {field.name})",
            f"offsetof(ibvs_{kind}, has_{field.name})" if field.optional else "IBVS_NO_FLAG",
            str((*field.shape, 1)[0]),
            real(field.low, single),
            real(field.high, single),
            str(field.unit_length).lower(),
            str(field.held).lower(),
            f"IBVS_REJECT_{REJECTIONS.get(kind, REJECTIONS.get(field.name, _capitals(field.name)))}",
        )
        rows.append(f"  {{{', '.join(entries)}}},")
    return [f"const ibvs_field ibvs_{kind}_fields[] = {{", *rows, "};", ""]
