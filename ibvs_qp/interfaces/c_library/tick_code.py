"""The tick as C code by CasADi, in double or single precision."""

from __future__ import annotations

import re
from pathlib import Path

import casadi as ca

from ibvs_qp.model.inputs import setting_values
from ibvs_qp.model.model import Model
from ibvs_qp.model.tick import tick_signals
from ibvs_qp.qp.problem import QpProblem
from ibvs_qp.symbolic.logic import both, where
from ibvs_qp.symbolic.signals import Signals, places, stack
from ibvs_qp.tasks.line import line_state

NAME = "ibvs_tick"
#: Outputs that the library reads, or reports.
OUTPUTS = (
    "normal",
    "contact_weight",
    "push_command",
    "turning_lever",
    "bias_wrench",
    "thrust_lower",
    "thrust_upper",
    "reach",
    "contact.known",
    "contact.touching",
    "contact.push",
    "contact.distance",
)
#: Numbers with a point or an exponent, which C takes for doubles.
_DOUBLE = re.compile(r"(?<![\w.])((?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+)(?![\w.])")
#: CasADi calls these for doubles, even in single precision; the library's own names choose the precision.
_FUNCTIONS = re.compile(r"\b(?:casadi_)?(sin|cos|tan|asin|acos|atan|atan2|exp|log|pow|sqrt|fabs|fmin|fmax|floor)\(")
#: Every argument and result is there; a number is no condition.
_CHECKS = (
    (re.compile(r"\((a\d+)\?"), r"(\1!=0?"),
    (re.compile(r"\((a\d+)(&&|\|\|)(a\d+)\)"), r"(\1!=0\2\3!=0)"),
    (re.compile(r"\(!\s*(a\d+)\)"), r"(\1==0)"),
    (re.compile(r"if \(res\[\d+\]!=0\) "), ""),
    (re.compile(r"(arg\[\d\])\? (arg\[\d\]\[\d+\]) : 0"), r"\2"),
)


class TickCode:
    """The tick's function, with the law's terms for the analytic fallback next to the program.

    Outputs for reports and supervision are left out, with the states that only they need: a third of the code.

    Attributes:
        signals: Inputs, states and outputs of the tick.
        function: (inputs, states) to next states, their sum, outputs, program, analytic terms.

    Args:
        problem: The program.
        further: Further outputs of the law.
    """

    def __init__(self, problem: QpProblem, further: tuple[str, ...] = ()) -> None:
        values = setting_values(problem.model.config).items()
        constants = {name: value for name, value in values if not name.startswith("gains.")}
        extra = [*problem.values, *analytic_terms(problem.model)]
        self.signals, (point, *results) = tick_signals(problem.model, extra, constants)
        available = self.signals.outputs | {
            name: point[place] for name, place in places(problem.model.signals.inputs).items()
        }
        self.signals.outputs = {name: available[name] for name in (*OUTPUTS, *further)}
        _drop_states(self.signals, [*self.signals.outputs.values(), *results])
        states = ca.densify(self.signals.next_states)
        outputs = [states, ca.sum1(states), stack(self.signals.outputs), *map(ca.densify, results)]
        inputs = [stack(self.signals.inputs), stack(self.signals.states)]
        self.function = ca.Function(NAME, inputs, ca.cse(outputs))

    def write(self, folder: Path, single: bool) -> None:
        """Write ``ibvs_tick.c``."""
        write_function(folder, NAME, self.function, "Sensors, reference and states to set-points and program", single)


def write_function(folder: Path, name: str, function: ca.Function, content: str, single: bool) -> None:
    """Write a function as C code: straight-line code, no branches on missing arguments, one precision.

    Args:
        folder: Receives ``<name>.c``.
        name: Of the C function.
        function: (inputs, states) to next states, their sum, and further results.
        content: Inputs and results, for the comment at the head.
        single: Numbers are floats.
    """
    generator = ca.CodeGenerator(name, {"casadi_real": "ibvs_real", "casadi_int": "int"})
    generator.add(function)
    code = generator.dump()
    begin = code.index("{", code.index("static int casadi_f0"))
    body = code[begin : code.index("CASADI_SYMBOL_EXPORT", begin)].replace("  return 0;\n", "")
    for pattern, replacement in _CHECKS:
        body = pattern.sub(replacement, body)
    body = _FUNCTIONS.sub(r"r_\1(", body).replace("casadi_sq(", "square(").replace("casadi_inf", "INFINITY")
    body = body.replace("casadi_real", "ibvs_real")
    if single:
        body = _DOUBLE.sub(r"\1f", body)
    (folder / f"{name}.c").write_text(_HEAD.format(content=content, name=name) + body)


def analytic_terms(model: Model) -> list[ca.SX]:
    """Terms of `ibvs_qp.analytic`: rows of the lines, commanded image accelerations, secondary acceleration.

    Returns:
        Rows in sequence, (6 (slots + 1),): the row of every line, then the angle of the line nearest the image
        centre; rows of absent lines are zero. Commands, (slots + 1,). Acceleration for their null space, (6,).
    """
    twist = model.camera_twist
    rows, commands = [], []
    level_row, level_command, nearest = ca.SX.zeros(1, 6), ca.SX(0.0), ca.SX(ca.inf)
    for line in model.lines:
        state = line_state(model, line.index)
        rows.append(where(line.present, state.analytic_row, ca.SX.zeros(1, 6)))
        commands.append(where(line.present, state.analytic_command, 0.0))
        if not model.config.analytic_angle_row:
            continue
        nearer = both(line.present, ca.fabs(line.rho) < nearest)
        nearest = where(nearer, ca.fabs(line.rho), nearest)
        level_row = where(nearer, state.row_theta @ twist, level_row)
        level_command = where(nearer, state.angle_command, level_command)
    rows, commands = [*rows, level_row], [*commands, level_command]
    out, wall = model.signals.outputs, model.wall
    standoff = (1.0 - model.contact_weight) * out["standoff_command"] / model.config.vehicle.mass_kg
    right, down = ca.vertsplit(out["velocity_command"])
    linear = wall.normal * standoff + wall.right * right + wall.down * down
    secondary = ca.vertcat(linear, out["level_command"], out["yaw_command"])
    return [ca.vec(ca.vertcat(*rows).T), ca.vertcat(*commands), secondary]


def _drop_states(signals: Signals, results: list[ca.SX]) -> None:
    """Drop the states on which no result depends, now or later."""
    needed: set[str] = set()
    while True:
        symbols = {symbol.name() for symbol in ca.symvar(ca.veccat(*results, *map(signals.next_state, needed)))}
        found = {
            name for name, state in signals.states.items() if symbols & {entry.name() for entry in ca.symvar(state)}
        }
        if found == needed:
            break
        needed = found
    signals.states = {name: state for name, state in signals.states.items() if name in needed}


_HEAD = """/* {content}, and next states. Generated by CasADi from the equations of
 * the Python package ibvs_qp; straight-line code without loops or allocation. */
#include "ibvs_internal.h"

static ibvs_real square(ibvs_real x) {{ return x * x; }}

void {name}(const ibvs_real *const *arg, ibvs_real *const *res) """
