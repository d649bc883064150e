"""Recorded inputs through a new pilot and through a new controller; the outputs as arrays.

Open loop: every tick gets what was recorded, whatever the ticks before answered, so that differences do not compound
through the vehicle.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ibvs_qp import Command, FeatureFrame

from . import internals
from .broken import broken
from .cases import CASES, DATA, Case
from .recordings import Recording, load
from .tables import Table, feature_table, with_prefix

#: The program is taken every so many ticks.
PROGRAM_TICKS = 40


class _Outputs:
    """Collects what came out, tick by tick."""

    def __init__(self) -> None:
        self.commands: list[Command] = []
        self.limits: list[str] = []
        self.programs: dict[int, dict[str, np.ndarray]] = {}

    def add(self, command: Command, program: Callable[[], dict[str, np.ndarray] | None]) -> None:
        tick = len(self.commands)
        self.commands.append(command)
        self.limits.append(", ".join(sorted(f"{limit.name} {limit.side}" for limit in command.active_limits)))
        if tick % PROGRAM_TICKS == 0 and (now := program()) is not None:
            self.programs[tick] = now

    def table(self) -> Table:
        table = {
            "thrusts": np.array([command.thrusts for command in self.commands]),
            "outcome": np.array([str(command.outcome) for command in self.commands]),
            "mode": np.array([command.mode for command in self.commands]),
            "rejected": np.array(["; ".join(command.rejected) for command in self.commands]),
            "active_limits": np.array(self.limits),
        }
        if self.programs:
            table["program_tick"] = np.array(list(self.programs))
            for name in ("P", "q", "A", "l", "u"):
                table[name] = np.array([program[name] for program in self.programs.values()])
        return table


def replay_pilot(case: Case, recording: Recording) -> Table:
    """Sensor frames and thrust limits through a new pilot."""
    pilot, outputs = case.pilot(), _Outputs()
    results: list[FeatureFrame | None] = []
    for frame, limits in zip(recording.frames, recording.thrust_limits, strict=True):
        pilot.thrust_limits = limits
        outputs.add(pilot.step(frame), lambda: internals.program(pilot.controller))
        results.append(None if frame.image is None else internals.perceived(pilot))
    table = outputs.table()
    return table | with_prefix("percept_", feature_table(results, float)) if case.pictures else table


def replay_controller(case: Case, recording: Recording) -> Table:
    """Measurements and references through a new controller."""
    controller, outputs = case.controller(), _Outputs()
    for measurement, reference in zip(recording.measurements, recording.references, strict=True):
        outputs.add(controller.step(measurement, reference), lambda: internals.program(controller))
    return outputs.table()


def replay(name: str) -> Table:
    """Both ways; the names of the arrays begin with "pilot." and "controller."."""
    case = CASES[name]
    recording = load(DATA / f"{case.inputs_of or name}.inputs.npz")
    if case.inputs_of is not None:
        recording = broken(recording)
    through_pilot, through_controller = replay_pilot(case, recording), replay_controller(case, recording)
    return with_prefix("pilot.", through_pilot) | with_prefix("controller.", through_controller)
