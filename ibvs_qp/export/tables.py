"""Tables of the C library: bounds of the inputs, start values and vehicle: ``ibvs_tables.c``."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np

from allocation.effectiveness import control_effectiveness
from allocation.least_squares import DEFAULT_ROW_WEIGHTS
from ibvs_qp.config import Gains
from ibvs_qp.export.layout import c_name
from ibvs_qp.export.tick_code import TickCode
from ibvs_qp.measurement import Reference
from ibvs_qp.qp.problem import QpProblem
from ibvs_qp.qp.program_code import real, reals, table
from ibvs_qp.validation.fields import REFERENCE, Field, FieldTable, measurement_table


def write_tables(folder: Path, problem: QpProblem, tick: TickCode, single: bool) -> None:
    """Write ``ibvs_tables.c``."""
    config, signals = problem.model.config, tick.signals
    vehicle = config.vehicle
    effectiveness = control_effectiveness(vehicle.geometry)
    measurements = measurement_table(vehicle.geometry.count)
    starts = np.concatenate([signals.starts[name] for name in signals.states])
    gains = fields(Gains)
    numbers = {
        "default": [getattr(config.gains, field.name) for field in gains],
        "least": [field.metadata["low"] for field in gains],
        "largest": [field.metadata["high"] for field in gains],
    }
    lines = [
        "/* Bounds of the inputs, start values and vehicle; generated. */",
        '#include "ibvs_internal.h"',
        "",
        *_field_table("measurement", measurements, single),
        *_field_table("reference", REFERENCE, single),
        f"const ibvs_measurement ibvs_first_measurement = {{{_first(measurements, single)}}};",
        f"const ibvs_reference ibvs_first_reference = {{{_reference(single)}}};",
        *(f"const ibvs_gains ibvs_{name}_gains = {{{reals(values, single)}}};" for name, values in numbers.items()),
        table("ibvs_real", "ibvs_start_states", starts, single),
        table("ibvs_real", "ibvs_thrust_floor", vehicle.thrust_min, single),
        table("ibvs_real", "ibvs_thrust_ceiling", vehicle.thrust_max, single),
        table("ibvs_real", "ibvs_effectiveness", effectiveness, single),
        table("ibvs_real", "ibvs_inverse", np.linalg.pinv(effectiveness), single),
        table("ibvs_real", "ibvs_mass_matrix", vehicle.mass_matrix, single),
        table("ibvs_real", "ibvs_allocation_weights", DEFAULT_ROW_WEIGHTS, single),
        "",
    ]
    (folder / "ibvs_tables.c").write_text("\n".join(lines))


def _field_table(kind: str, rows: FieldTable, single: bool) -> list[str]:
    return [
        f"const ibvs_field ibvs_{kind}_fields[] = {{",
        *(f"  {{{_row(kind, field, single)}}}," for field in rows.rows),
        "};",
        "",
    ]


def _row(kind: str, field: Field, single: bool) -> str:
    structure = f"ibvs_{kind}"
    flag = f"offsetof({structure}, has_{field.name})" if field.optional else "IBVS_NO_FLAG"
    bit = "IBVS_REJECT_REFERENCE" if kind == "reference" else f"IBVS_REJECT_{c_name(field.name)}"
    entries = (
        f"offsetof({structure}, {field.name})",
        flag,
        str(max(field.size, 1)),
        real(field.low, single),
        real(field.high, single),
        str(field.unit_length).lower(),
        str(field.held).lower(),
        bit,
    )
    return ", ".join(entries)


def _first(rows: FieldTable, single: bool) -> str:
    """Values in force before the first measurement."""
    return ", ".join(f".{field.name} = {{{reals(field.fallback, single)}}}" for field in rows.rows if field.fallback)


def _reference(single: bool) -> str:
    first = Reference()
    return ", ".join(f".{name} = {real(getattr(first, name), single)}" for name in ("push_force", "standoff"))
