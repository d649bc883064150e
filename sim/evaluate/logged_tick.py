"""One tick of an MCAP log as a trace, for `ibvs-qp explain`: logs of own loops, of bags and of `paint` alike."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ibvs_qp.command import Command
from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.config.files import parse_toml
from ibvs_qp.config.settings import from_dict
from ibvs_qp.controller import HybridController
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.interfaces.log import read_log, replayed
from ibvs_qp.interfaces.log.header import PILOT, recorded_controller
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.supervision.assured import Assured
from sim.flight.assemble import OUTCOMES
from sim.flight.trace import Event, Trace
from sim.world.scene import Scene


def logged_tick(file: Path, at_s: float) -> Trace:
    """The tick nearest a time since the first one, as a trace of one tick; the log is replayed up to it.

    Raises:
        IbvsQpError: When the log was not flown under the QP law, or the time is outside of it.
        ConfigError: When its controller cannot be built.
    """
    flight = read_log(file)
    flown = recorded_controller(flight.facts)
    law = flown.controller if isinstance(flown, Assured) else flown
    if not isinstance(law, HybridController):
        raise IbvsQpError(f"{file} was not flown under the QP law, and has no program to explain")
    if not at_s >= 0.0:
        raise IbvsQpError(f"--at {at_s:g} s: the log begins at 0")
    events, kinds, begin_ns, found, phase = list[Event](), set[str](), None, None, ""
    for _, command in replayed(flight, flown):
        if command is None:
            continue
        begin_ns = command.stamp_ns if begin_ns is None else begin_ns
        time_s = 1e-9 * (command.stamp_ns - begin_ns)
        if found is not None and abs(float(found["t"][0]) - at_s) < abs(time_s - at_s):
            break
        for text in command.rejected:
            if (kind := text.split(":")[0]) not in kinds:
                kinds.add(kind)
                events.append(Event(t=time_s, kind="rejected", text=text))
        found, phase = _arrays(law, command, time_s), flight.phase
    if found is None:
        raise IbvsQpError(f"{file} has no tick of a controller up to its first gap")
    if at_s > float(found["t"][0]) + law.config.tick_s:
        raise IbvsQpError(f"--at {at_s:g} s: the log lasts from 0 to {float(found['t'][0]):.2f} s")
    return Trace(
        scene=Scene(), seed=0, law="qp", arrays=found, phases=(phase or "own loop",), outcomes=OUTCOMES, events=events,
        preset=_preset(flight.facts, law).to_toml(derived=True),
    )  # fmt: skip


def _arrays(law: HybridController, command: Command, time_s: float) -> dict[str, np.ndarray]:
    """Arrays of the explanation (`sim.flight.trace.FIELDS`), of one tick."""
    views = law.setpoints.step.outputs | law.setpoints.step.inputs
    numbers = {
        "t": time_s,
        "phase": 0,
        "outcome": OUTCOMES.index(str(command.outcome)),
        "iterations": command.iterations,
        "reach_margin": command.reach_margin,
        "contact_weight": views["contact_weight"].item(),
        "push_measured": views["contact.push"].item(),
        "push_reference": (views["push_reference"] * views["contact.ramp"]).item(),
    }
    arrays = {name: np.array([value]) for name, value in numbers.items()}
    rows = {"thrusts": command.thrusts, "unallocated": command.unallocated_wrench, "program": law.setpoints.step.point}
    return arrays | {name: np.array([values], float) for name, values in rows.items()}


def _preset(facts: Mapping[str, str], law: HybridController) -> PilotConfig:
    """Configuration of the flight, with the controller that was replayed."""
    if facts["kind"] != PILOT:
        return PilotConfig(controller=law.config)
    config = from_dict(PilotConfig, parse_toml(facts["config"], "the log's configuration"))
    return dataclasses.replace(config, controller=straightened(config.controller))
