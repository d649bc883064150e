"""One tick as one function with explicit state: sensors and reference in, set-points and program out.

.. math:: (s_{k+1}, point, outputs, P, q, A, l, u) = tick(sensors_k, reference_k, s_k)

Two parts. The first brings the sensors to the present: contact estimation, and late lines and velocities carried by
the motion since their capture. The second is the law, whose inputs (`ibvs_qp.model.inputs`) the first computes. They
are one CasADi function, for Python and for the generated C code.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import casadi as ca

from ibvs_qp.config import LONGEST_TICK, ControllerConfig
from ibvs_qp.estimation.contact import contact_state
from ibvs_qp.estimation.inputs import CONTACT, gravity_direction
from ibvs_qp.estimation.motion_history import (
    LATE_S,
    MotionHistory,
    aligned,
    carried_line,
    carried_velocity,
    carried_wall,
    motion_since,
)
from ibvs_qp.estimation.tick_history import FIRST_INTERVAL, LONGEST_INTERVAL
from ibvs_qp.estimation.wall_distance import NEVER_S, Plane, Tick
from ibvs_qp.model.inputs import TARGET
from ibvs_qp.model.model import Model
from ibvs_qp.symbolic.function import StepFunction, step_function
from ibvs_qp.symbolic.logic import both, either, no, where
from ibvs_qp.symbolic.machine_code import cache_folder, compiler, machine_code
from ibvs_qp.symbolic.signals import GatedSignals, Signals, places, stack

#: Sensors that are arrays, and their sizes, in the order of packing (`ibvs_qp.model.packing`).
ARRAYS = {
    "attitude": 4,
    "angular_velocity": 3,
    "contact_wrench": 6,
    "specific_force": 3,
    "velocity": 3,
    "acceleration_bias": 3,
    "plane": 4,
}
#: Scalars that follow: time since the last tick [s]; whether specific force, velocity and plane are known; ages [s].
SCALARS = (
    "elapsed",
    "specific_force_known",
    "velocity_known",
    "velocity_age",
    "wrench_age",
    "plane_known",
    "plane_age",
)
#: Contact of a caller: whether there is one, and its entries.
GIVEN = {"given": 1, "given.normal": 3, "given.contact_weight": 1} | {f"given.{name}": 1 for name in CONTACT}
#: Scalars of every line: as measured ``age`` [s] ago, its reference, and whether the index has changed its reference.
LINE = (
    "present",
    "vertical",
    "rho",
    "theta",
    "rho_reference",
    "theta_reference",
    "confidence",
    "variance",
    "age",
    "changed",
)
#: Entries of the contact estimate that have other names as inputs of the law.
ESTIMATED = {"moment_noise": "across_noise", "touching": "in_contact"}
#: States of a line that end with its reference.
LINE_STATES = ("integral", "last")
#: After a caller's own contact, an estimate older than this is not continued [s]: the tip moved on meanwhile.
ESTIMATE_LIFE_S = 0.5
#: Samples nearer to each other than this are the same [s]: no sensor is faster than 10 kHz.
SAME_S = 1e-4
#: Lines farther than this from the optical axis are ignored: the interaction matrix degenerates [normalised].
RHO_BOUND = 1.5


class TickFunction(StepFunction):
    """The compiled tick.

    Attributes:
        sensed: Views of the inputs by name: sensors, reference, thrusts, and the parameters of further tasks.
        inputs: Views of the inputs of the law by name, as the last evaluation computed them.
        point: All inputs and states of the law at the last evaluation: they reproduce set-points and program.

    Args:
        model: The law, complete: all tasks have written their rows.
        extra: Further results, such as the program's values.
    """

    def __init__(self, model: Model, extra: Sequence[ca.SX] = ()) -> None:
        signals, function = model.built(("tick", *map(id, extra)), lambda: _tick(model, extra))[:2]
        if model.config.compiled:
            function = _translated(model, function)
        super().__init__(signals, function=function)
        self.sensed, (self.point, *self.extra) = self.inputs, self.extra
        self.inputs = {name: self.point[place] for name, place in places(model.signals.inputs).items()}


def _tick(model: Model, extra: Sequence[ca.SX]) -> tuple[Signals, ca.Function, Sequence[ca.SX]]:
    signals, results = tick_signals(model, extra)
    return signals, step_function(signals, results), extra  # the identities in the key stay those of living objects


def _translated(model: Model, function: ca.Function) -> ca.Function:
    """The function as machine code, in a process once per compiler and cache folder."""
    key = ("machine code", function.__hash__(), *(compiler() or ()), str(cache_folder()))
    if key in model.code:
        return model.code[key]
    found = machine_code(function)
    if found is not function:
        model.code[key] = found
    return found


def tick_signals(
    model: Model, extra: Sequence[ca.SX] = (), constants: Mapping[str, float] = MappingProxyType({})
) -> tuple[Signals, list[ca.SX]]:
    """The tick's signals, and its further results: the point of the law, then ``extra``.

    Args:
        model: The law.
        extra: Further results.
        constants: Inputs of the law that are numbers of the equations instead, by name.
    """
    law, signals = model.signals, Signals()
    at_present = _at_present(signals, model.config) | {name: ca.SX(value) for name, value in constants.items()}
    inputs = [
        at_present[name] if name in at_present else signals.input(name, symbol.numel())
        for name, symbol in law.inputs.items()
    ]
    states = [signals.state(name, symbol.numel(), law.starts[name].tolist()) for name, symbol in law.states.items()]
    changed = {
        f"line_{index}_{state}": signals.input(f"line_{index}.changed")
        for index in range(model.config.line_slots)
        for state in LINE_STATES
    }
    states = [
        where(changed[name], ca.DM(law.starts[name]), state) if name in changed else state
        for name, state in zip(law.states, states, strict=True)
    ]
    outputs = [law.next_states, stack(law.outputs), *(ca.densify(entry) for entry in extra)]
    equations = ca.Function("law", [stack(law.inputs), stack(law.states)], outputs)
    point = ca.vertcat(*inputs), ca.vertcat(*states)
    next_states, values, *results = equations.call(point)
    for name, place in places(law.states).items():
        signals.remember(name, next_states[place])
    for name, place in places(law.outputs).items():
        signals.output(name, values[place])
    return signals, [ca.vertcat(*point), *results]


def _at_present(signals: Signals, config: ControllerConfig) -> dict[str, ca.SX]:
    """Inputs of the law that the sensors do not give as they are, by name."""
    _declare(signals, config.line_slots)
    value = signals.inputs
    elapsed = value["elapsed"]
    tick = Tick(
        dt=ca.fmin(elapsed, LONGEST_TICK),
        elapsed=elapsed,
        rate=value["angular_velocity"],
        force=value["specific_force"],
        force_known=value["specific_force_known"],
        down=gravity_direction(value["attitude"]),
        doubt=ca.SX(0.0),
    )
    last_velocity = signals.state("late.velocity", 3)
    history = MotionHistory(signals, elapsed, tick.rate, tick.acceleration, config.tick_s, last_velocity)
    contact = _contact(signals, config, tick, history)

    age, known = value["velocity_age"], value["velocity_known"]
    carried = carried_velocity(value["velocity"], motion_since(history, age))
    velocity = where(both(known, age > LATE_S), carried, value["velocity"])
    signals.remember("late.velocity", where(known, velocity, last_velocity))
    return {"dt": tick.dt, "velocity": velocity, **contact, **_lines(signals, config, history, contact)}


def _declare(signals: Signals, lines: int) -> None:
    """Declare everything that is packed at every tick, first of all inputs, so that it is one block."""
    for name, size in ARRAYS.items():
        signals.input(name, size)
    for name in SCALARS:
        signals.input(name)
    for name, size in GIVEN.items():
        signals.input(name, size)
    for name in TARGET:
        signals.input(f"reference.{name}")
    for index in range(lines):
        for name in LINE:
            signals.input(f"line_{index}.{name}")


def _contact(signals: Signals, config: ControllerConfig, tick: Tick, history: MotionHistory) -> dict[str, ca.SX]:
    """The caller's contact, or the estimate; while there is a caller's, the estimator stands still."""
    value = signals.inputs
    given, held = value["given"], signals.state("estimate.held_s")
    without = held + tick.elapsed
    restart = both(no(given), held > 0.0, without > ESTIMATE_LIFE_S)
    signals.remember("estimate.held_s", where(given, without, 0.0))
    elapsed = where(restart, config.tick_s, without)
    tick = tick._replace(dt=ca.fmin(elapsed, LONGEST_TICK), elapsed=elapsed)
    gated = GatedSignals(signals, restart, given)
    since_plane = _since_last(gated, "plane", elapsed, value["plane_age"], value["plane_known"])
    plane = Plane(new=since_plane > 0.0, age=value["plane_age"], values=value["plane"])
    since_wrench = _since_last(gated, "wrench", elapsed, value["wrench_age"], ca.SX(1.0))
    interval = where(since_wrench < NEVER_S / 2, ca.fmin(since_wrench, LONGEST_INTERVAL), FIRST_INTERVAL)
    wrench, press = value["contact_wrench"], value["reference.press"]
    estimate = contact_state(gated, config, tick, history, plane, wrench, interval, press)
    for name, entry in estimate.items():
        signals.output(f"estimate.{name}", entry)
    contact = {
        f"contact.{name}": where(given, value[f"given.{name}"], estimate[ESTIMATED.get(name, name)]) for name in CONTACT
    }
    weight = where(given, value["given.contact_weight"], estimate["contact_weight"])
    contact["normal"] = where(given, value["given.normal"], estimate["normal"])
    contact["contact_weight"] = where(value["reference.press"], weight, 0.0)
    return contact


def _since_last(signals: Signals, name: str, elapsed: ca.SX, age: ca.SX, known: ca.SX) -> ca.SX:
    """Time from the last sample to this one [s], 0 if it is no new one; about `NEVER_S` for the first."""
    last = signals.state(f"{name}.age", start=NEVER_S) + elapsed
    new = both(known, last - age > SAME_S)
    signals.remember(f"{name}.age", where(new, age, ca.fmin(last, NEVER_S)))
    return where(new, last - age, 0.0)


def _lines(
    signals: Signals, config: ControllerConfig, history: MotionHistory, contact: dict[str, ca.SX]
) -> dict[str, ca.SX]:
    """Lines carried to the present, with the sign of their references."""
    value, camera = signals.inputs, ca.DM(config.vehicle.camera_position_m)
    wall = carried_wall(value["plane"], motion_since(history, value["plane_age"]), camera)
    lines = {}
    for index in range(config.line_slots):
        present, rho, theta, reference, age = (
            value[f"line_{index}.{name}"] for name in ("present", "rho", "theta", "theta_reference", "age")
        )
        moved = carried_line(rho, theta, wall, motion_since(history, age), camera)
        late = both(value["plane_known"], age > LATE_S)
        rho, theta = aligned(where(late, moved[0], rho), where(late, moved[1], theta), reference)
        beyond = either(rho <= -RHO_BOUND, rho >= RHO_BOUND)
        lines[f"line_{index}.present"] = both(present, contact["contact.known"], no(beyond))
        lines[f"line_{index}.rho"], lines[f"line_{index}.theta"] = where(beyond, 0.0, rho), theta
    return lines
