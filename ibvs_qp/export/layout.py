"""Sizes, places and constants of the C library, from the declarations that Python uses: ``ibvs_layout.h``."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from ibvs_qp.analytic import RANK_TOLERANCE
from ibvs_qp.config import ControllerConfig, Gains
from ibvs_qp.export.tick_code import TickCode
from ibvs_qp.frames import GRAVITY
from ibvs_qp.model.hover import hover_gains
from ibvs_qp.model.setpoints import ANY_STEP
from ibvs_qp.model.tick import LINE
from ibvs_qp.qp.problem import QpProblem
from ibvs_qp.symbolic.literals import real
from ibvs_qp.symbolic.signals import places
from ibvs_qp.validation import clock, geometry
from ibvs_qp.validation import fields as bounds
from ibvs_qp.validation.measurement import LINES_PER_SLOT, OLDEST_LINE_NS


def sizes(problem: QpProblem, tick: TickCode) -> dict[str, int]:
    """Sizes by name."""
    config, function = problem.model.config, tick.function
    return {
        "LINES": config.line_slots,
        "MOST_LINES": LINES_PER_SLOT * config.line_slots,
        "LINE_ENTRIES": len(LINE),
        "INPUTS": function.numel_in(0),
        "STATES": function.numel_in(1),
        "RESULTS": function.numel_out(2),
        "GAINS": len(fields(Gains)),
        "MEASUREMENT_FIELDS": len(bounds.measurement_table(config.vehicle.geometry.count).rows),
        "REFERENCE_FIELDS": len(bounds.REFERENCE.rows),
        "RECOVERY_TICKS": config.solver.recovery_ticks,
        "RESTART_STAMPS": clock.RESTART_STAMPS,
    }


def times() -> dict[str, int]:
    """Times by name [ns]."""
    return {
        "STAMP_END": clock.STAMP_END,
        "LEAP_NS": clock.LEAP_NS,
        "RESTART_NS": clock.RESTART_NS,
        "LEAD_NS": clock.LEAD_NS,
        "OLDEST_LINE_NS": OLDEST_LINE_NS,
    }


def constants(config: ControllerConfig) -> dict[str, float]:
    """Numbers by name."""
    vehicle = config.vehicle
    hover_kp, hover_kd = hover_gains(config)
    return {
        "TICK_S": config.tick_s,
        "MASS_KG": vehicle.mass_kg,
        "GRAVITY": GRAVITY,
        "HOVER_KP": hover_kp,
        "HOVER_KD": hover_kd,
        "RATE_STEP": vehicle.thrust_rate_n_s * config.tick_s,
        "ANY_STEP": ANY_STEP,
        "RANK_TOLERANCE": RANK_TOLERANCE,
        "UNIT_TOLERANCE": bounds.UNIT_TOLERANCE,
        "LINE_BOUND": geometry.LINE_BOUND,
        "VARIANCE_BOUND": geometry.VARIANCE_BOUND,
        "INVERSE_DEPTH_BOUND": geometry.INVERSE_DEPTH_BOUND,
        "INVERSE_DEPTH_MIN": geometry.INVERSE_DEPTH_MIN,
    }


def _enumeration(prefix: str, starts: dict[str, slice]) -> list[str]:
    entries = (f"  IBVS_{prefix}_{c_name(name)} = {place.start}" for name, place in starts.items())
    return ["enum {", ",\n".join(entries), "};", ""]


def c_name(name: str) -> str:
    """Name of a signal in capitals."""
    return name.replace(".", "_").upper()


def write_layout(folder: Path, problem: QpProblem, tick: TickCode, single: bool) -> None:
    """Write ``ibvs_layout.h``."""
    config, signals = problem.model.config, tick.signals
    starts = places(signals.inputs)
    gains = [field.name for field in fields(Gains)]
    starts["gains"] = slice(starts[f"gains.{gains[0]}"].start, 0)
    lines = [
        "/* Sizes, places and constants of this configuration; generated. */",
        "#ifndef IBVS_LAYOUT_H",
        "#define IBVS_LAYOUT_H",
        "",
        '#include "ibvs_program_layout.h"',
        "",
        *(f"#define IBVS_{name} {value}" for name, value in sizes(problem, tick).items()),
        *(f"#define IBVS_{name} INT64_C({value})" for name, value in times().items()),
        *(f"#define IBVS_{name} {real(value, single)}" for name, value in constants(config).items()),
        f"#define IBVS_FIRST_GAIN {gains[0]}",
        "",
        "/* Gains; each within its range. */",
        "typedef struct {",
        *(f"  ibvs_real {field.name}; /* {_explained(field)} */" for field in fields(Gains)),
        "} ibvs_gains;",
        "",
        "/* Places of the inputs and results. */",
        *_enumeration("IN", starts),
        *_enumeration("OUT", places(signals.outputs)),
        "#endif",
        "",
    ]
    (folder / "ibvs_layout.h").write_text("\n".join(lines))


def _explained(field: object) -> str:
    settings = field.metadata  # type: ignore[attr-defined]
    unit = f" [{settings['unit']}]" if settings.get("unit") else ""
    return f"{settings['doc']}{unit}, {settings['low']:g} to {settings['high']:g}"
