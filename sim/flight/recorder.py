"""Log of a flight: truth and the pilot's estimates of every tick, assembled into a trace at the end."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ibvs_qp.command import Command, Outcome, SafetyState
from ibvs_qp.config.settings import dump_toml
from ibvs_qp.controller import HybridController
from ibvs_qp.interfaces.overlay import draw_overlay
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from ibvs_qp.pilot.painting.strategy import PHASES
from sim.flight.assemble import NUMBERS, OUTCOMES, Flown, LoggedRows, assemble, logged_signals
from sim.flight.journal import CHUNK_S, Columns, Header, Journal
from sim.flight.options import FlightOptions, ticks_in
from sim.flight.pictures import pack_picture
from sim.flight.surroundings import World
from sim.flight.trace import Event, Trace
from sim.world.plant import Plant
from sim.world.scene import Scene

#: Pictures per second of the video [Hz].
VIDEO_RATE = 10.0
_PHASE_INDEX = {phase: index for index, phase in enumerate(PHASES)}
_OUTCOME_INDEX = {outcome: float(index) for index, outcome in enumerate(Outcome)}


def controller_signals(pilot: Pilot) -> dict[str, np.ndarray]:
    """Signals of the controller's step that are logged, by name: 1-D views that hold after every step."""
    step = pilot.setpoints.step
    views = step.outputs | step.inputs
    return {name: views[name] for name in logged_signals(pilot.config.controller.line_slots)}


def program_point(pilot: Pilot) -> np.ndarray | None:
    """Inputs and states that reproduce the quadratic program, a view; None under the analytic law."""
    return pilot.setpoints.step.point if isinstance(pilot.controller, HybridController) else None


def truth_signals(plant: Plant) -> dict[str, np.ndarray]:
    """Signals of the plant that are logged, by name: 1-D views that hold after every tick."""
    return {"truth": plant.truth, "pushes": plant.pushes, "thrusts_actual": plant.motor_thrusts}


class _Kept(NamedTuple):
    """Contents of the journal."""

    ticks: int = 0
    events: int = 0
    pictures: int = 0


class Recorder:
    """Rows of the log, one per tick; `trace` turns them into named arrays."""

    def __init__(self, scene: Scene, options: FlightOptions, world: World, pilot: Pilot) -> None:
        self._scene, self._options, self._world, self._pilot = scene, options, world, pilot
        rotors = pilot.config.controller.vehicle.geometry.count
        signals = controller_signals(pilot) | truth_signals(world.plant)
        widths = {name: len(view) for name, view in signals.items()}
        widths = dict.fromkeys(NUMBERS, 1) | widths | {"thrusts": rotors, "unallocated": 6}
        self._log = Columns(widths)
        self._signals = tuple(signals.values())
        self._limits: dict[str, int] = {}
        self._active: dict[int, list[tuple[int, float]]] = {}
        self._program = program_point(pilot)
        # Single precision halves the log; its rounding of 1e-7 does not change the output of `ibvs-qp explain`.
        self._programs = Columns({"program": 0 if self._program is None else len(self._program)}, np.float32)
        self._vision: list[float] = []
        self._events: list[Event] = []
        self._pictures: list[tuple[float, np.ndarray, str]] = []
        self._next_picture = 0.0
        self._rejected: set[str] = set()
        self._safety = SafetyState.NOMINAL
        self._logged = self._ticks = 0
        self._journal: Journal | None = None
        self._chunk = ticks_in(CHUNK_S, pilot.config.controller.tick_s)
        self._kept = _Kept()
        if options.journal:
            scene_text, preset = dump_toml(world.scene), pilot.config.to_toml(derived=True)
            points = 0 if self._program is None else len(self._program)
            header = Header(options.law, options.seed, scene_text, preset, widths, points)
            self._journal = Journal(Path(options.journal), header)

    def tick(self, frame: SensorFrame, command: Command) -> None:
        """Log one tick, after the plant has moved."""
        pilot, time_s = self._pilot, frame.stamp_ns * 1e-9
        painter = pilot.painter
        phase = painter.phase
        numbers = (
            time_s,
            _PHASE_INDEX[phase],
            painter.row,
            _OUTCOME_INDEX[command.outcome],
            pilot.controller_time_s * 1e6,
            command.iterations,
            command.reach_margin,
        )
        self._log.add(np.array(numbers), *self._signals, command.thrusts, command.unallocated_wrench)
        if self._program is not None:
            self._programs.add(self._program)
        active = command.active_limits
        if active:
            places = self._limits
            paid = [(places.setdefault(limit.name, len(places)), limit.price) for limit in active]
            self._active[self._ticks] = paid
        if command.rejected or len(painter.log) != self._logged or command.safety is not self._safety:
            self._note_events(time_s, command)
        if frame.image is not None and pilot.perception_result is not None and pilot.picture is not None:
            self._vision.append(sum(pilot.perception_result.time_ms.values()))
            if self._options.video and time_s >= self._next_picture:
                self._next_picture = time_s + 1.0 / VIDEO_RATE
                picture = pack_picture(draw_overlay(pilot.picture.rgb, pilot.perception_result))
                self._pictures.append((time_s, picture, phase))
        self._ticks += 1
        if self._journal is not None and self._ticks % self._chunk == 0:
            self._keep(self._journal)

    def _keep(self, journal: Journal) -> None:
        """Append new rows to the journal."""
        before, self._kept = self._kept, _Kept(self._ticks, len(self._events), len(self._vision))
        names, ticks = tuple(self._limits), range(before.ticks, self._ticks)
        paid = {tick: self._active[tick] for tick in ticks if tick in self._active}
        note = {
            "ticks": len(ticks),
            "events": [(event.t, event.kind, event.text) for event in self._events[before.events :]],
            "limits": {tick: [(names[index], price) for index, price in each] for tick, each in paid.items()},
            "vision_ms": self._vision[before.pictures :],
        }
        logs, programs = (table.rows(before.ticks, self._ticks) for table in (self._log, self._programs))
        journal.append(logs, programs, note)

    def _note_events(self, time_s: float, command: Command) -> None:
        log = self._pilot.painter.log
        for when, kind, text in log[self._logged :]:
            self._events.append(Event(t=when, kind=kind, text=text))
        self._logged = len(log)
        if command.safety is not self._safety:
            self._safety, reasons = command.safety, "; ".join(command.safety_reasons)
            self._events.append(Event(t=time_s, kind="safety", text=f"{command.safety}: {reasons}".removesuffix(": ")))
        for name in command.rejected:
            kind = name.split(":")[0]  # the numbers after it may change from tick to tick
            if kind not in self._rejected:
                self._rejected.add(kind)
                self._events.append(Event(t=time_s, kind="rejected", text=name))

    def note(self, time_s: float, kind: str, text: str) -> None:
        """Log an event from outside the pilot."""
        self._events.append(Event(t=time_s, kind=kind, text=text))

    def trace(self) -> Trace:
        """Everything logged so far as a trace; the flight is over."""
        if self._journal is not None:
            self._keep(self._journal)
            self._journal.close()
        # Ctrl-C may strike in the middle of a tick: its half-written row is dropped. The count comes last.
        ticks, plant, pilot = self._ticks, self._world.plant, self._pilot
        flown = Flown(
            scene=self._world.scene,
            seed=self._options.seed,
            law=self._options.law,
            config=pilot.config,
            vehicle=plant.vehicle,
            clearance=plant.clearance,
        )
        rows = LoggedRows(
            columns={name: column[:ticks] for name, column in self._log.arrays().items()},
            program=self._programs.arrays()["program"][:ticks] if len(self._programs) else None,
            limits=tuple(self._limits),
            active=self._active,
            vision_ms=self._vision,
            thrust_limits=plant.thrust_limits,
        )
        canvas = self._world.canvas
        trace = Trace(
            scene=flown.scene,
            seed=flown.seed,
            law=flown.law,
            arrays=assemble(flown, rows),
            phases=PHASES,
            outcomes=OUTCOMES,
            limits=rows.limits,
            events=self._events,
            canvas_px_per_m=canvas.pixels_per_m,
            coverage_mask=canvas.coverage,
            pictures=self._pictures,
            preset=pilot.config.to_toml(derived=True),
        )
        trace.draw_later(lambda: canvas.rgb)
        return trace
