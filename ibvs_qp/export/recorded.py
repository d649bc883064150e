"""Recorded ticks as C tables: what the self-test and the benchmark of the library replay."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.export.binding import Structures
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.qp.program_code import real, reals

#: Largest difference from the thrusts of Python [N], in double and in single precision: row filters carry the rounding
#: of a tick on to the next ones.
TOLERANCE, SINGLE_TOLERANCE_N = 5e-6, 0.03


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
    controller = HybridController(config)
    types = Structures(config, len(controller.problem.row_names), single)
    thrusts = [controller.step(*tick).thrusts for tick in ticks]
    parts = {
        "measurement ibvs_recorded_measurements": [literal(types.packed(tick[0]), single) for tick in ticks],
        "reference ibvs_recorded_references": [literal(types.packed_reference(tick[1]), single) for tick in ticks],
        "real ibvs_recorded_thrusts": [f"{{{reals(row, single)}}}" for row in thrusts],
    }
    code = ["/* Inputs of a recorded flight, and the thrusts of the Python controller [N]; generated. */"]
    code += ['#include "ibvs_recorded_ticks.h"', ""]
    for name, rows in parts.items():
        second = "[IBVS_ROTORS]" if name.startswith("real") else ""
        code += [f"const ibvs_{name}[IBVS_RECORDED_TICKS]{second} = {{", ",\n".join(rows), "};", ""]
    (folder / "ibvs_recorded_ticks.c").write_text("\n".join(code))
    tolerance = real(SINGLE_TOLERANCE_N if single else TOLERANCE, single)
    (folder / "ibvs_recorded_ticks.h").write_text(_HEADER.format(count=len(ticks), tolerance=tolerance))


def literal(value: Any, single: bool) -> str:
    """Initialiser of a structure, an array or a number; entries that are zero are left out of structures."""
    if isinstance(value, ctypes.Structure):
        members = ((name, getattr(value, name)) for name, *_ in value._fields_)
        return "{" + ", ".join(f".{name} = {literal(entry, single)}" for name, entry in members if any_set(entry)) + "}"
    if isinstance(value, ctypes.Array):
        entries = list(value)
        while len(entries) > 1 and not any_set(entries[-1]):
            entries.pop()
        return "{" + ", ".join(literal(entry, single) for entry in entries) + "}"
    if isinstance(value, float):
        return real(value, single)
    return f"INT64_C({value})" if type(value) is int and abs(value) > 2**31 - 1 else str(int(value))


def any_set(value: Any) -> bool:
    """Whether anything in a value is not zero."""
    if isinstance(value, ctypes.Structure):
        return any(any_set(getattr(value, name)) for name, *_ in value._fields_)
    return any(map(any_set, value)) if isinstance(value, ctypes.Array) else bool(value)


_HEADER = """/* Recorded flight for self-test and benchmark; generated. */
#ifndef IBVS_RECORDED_TICKS_H
#define IBVS_RECORDED_TICKS_H

#include "ibvs_qp.h"

#define IBVS_RECORDED_TICKS {count}
/* Largest difference from the thrusts of Python [N]. */
#define IBVS_RECORDED_TOLERANCE {tolerance}

extern const ibvs_measurement ibvs_recorded_measurements[IBVS_RECORDED_TICKS];
extern const ibvs_reference ibvs_recorded_references[IBVS_RECORDED_TICKS];
extern const ibvs_real ibvs_recorded_thrusts[IBVS_RECORDED_TICKS][IBVS_ROTORS];

#endif
"""
