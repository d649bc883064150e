"""One flight: plant, sensors, camera and pilot in one deterministic loop."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from ibvs_qp.command import Command
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot, PilotConfig
from sim.faults.fault import Fault
from sim.faults.schedule import FaultSchedule
from sim.flight.jobs import Job, OwnJob, PaintJob
from sim.flight.options import FlightOptions, pilot_config, ticks_in
from sim.flight.own_law import own_law
from sim.flight.recorder import Recorder
from sim.flight.surroundings import World
from sim.flight.trace import CRASH, INTERRUPTED, LANDED, TIME_OUT, Event, Trace
from sim.sensors.features import add_sigma_vs
from sim.world.board import BoardGeometry
from sim.world.random_streams import stream
from sim.world.scene import Scene

if TYPE_CHECKING:
    from sim.flight.mcap_log import McapLog

#: Called with simulated time [s], phase name and real-time factor.
Progress = Callable[[float, str, float], None]

#: Ending of MCAP logs.
MCAP = ".mcap"
#: Flight time between calls of the progress function [s].
PROGRESS_S = 0.5
#: Time-out of a flight [s]: start and corners, plus the strokes, each painted again twice, both ways, and slowly.
BASE_TIME, STROKE_FACTOR = 90.0, 8.0


def make_pilot(scene: Scene, options: FlightOptions, config: PilotConfig, job: Job) -> Pilot:
    """The pilot of one flight; the scene's extra feature noise follows its perception."""
    sigma, noise = scene.features.sigma_vs, stream(options.seed, "sigma_vs")
    rendered = options.features == "rendered"  # the sensor model of lines adds the same noise itself
    seen_as = (lambda frame: add_sigma_vs(frame, sigma, noise)) if rendered and sigma > 0.0 else None
    pilot = Pilot(config, job.strategy(config.painting), seen_as, own_law(options, straightened(config.controller)))
    if rendered:
        pilot.prepare()
    return pilot


def open_mcap(options: FlightOptions, world: World, pilot: Pilot) -> McapLog | None:
    """The MCAP log of a flight in the folder of its journal, if it has one."""
    if not options.mcap:
        return None
    from sim.flight.mcap_log import McapLog

    return McapLog(Path(options.journal) / f"{options.law}{MCAP}", world, pilot)


class ClosedLoop:
    """One flight, tick by tick: every tick is a `sense` and an `advance`; `fly` runs it to its end.

    Attributes:
        pilot: The pilot.
        world: Plant, sensors, canvas and camera.
        command: The pilot's last command; None before the first.
        ticks: Ticks flown.
        limit_s: Time-out [s].
        recorder_kind: Log of the flight; a subclass may keep less.
        reason: Why the flight ended before its strategy; empty without such an end.

    Args:
        scene: The truth.
        options: Law, seed, features, picture size and so on.
        config: Flown instead of the preset.
        job: Task at the wall; None paints.
        faults: Faults and their times.
    """

    recorder_kind: ClassVar[type[Recorder]] = Recorder

    def __init__(
        self,
        scene: Scene,
        options: FlightOptions,
        config: PilotConfig | None = None,
        job: Job | None = None,
        faults: tuple[Fault, ...] = (),
    ) -> None:
        config, self._job = pilot_config(scene, options, config), job or PaintJob()
        self.pilot, self.world = make_pilot(scene, options, config, self._job), World(scene, options, config)
        self._legs = tuple((float(right), float(down)) for right, down in self.pilot.painter.legs)
        self._recorder = self.recorder_kind(scene, options, self.world, self.pilot)
        self._schedule = FaultSchedule(faults, options.seed)
        self._log = open_mcap(options, self.world, self.pilot)
        self._step = self.pilot.step if self._log is None else self._log.step
        strokes = BoardGeometry(scene).strokes
        self.limit_s = BASE_TIME + STROKE_FACTOR * self._job.expected_s(config.painting, strokes)
        self.command: Command | None = None
        self.ticks, self.reason = 0, ""

    @property
    def time_s(self) -> float:
        """Time flown [s]."""
        return self.world.plant.time_ns * 1e-9

    @property
    def going(self) -> bool:
        """Whether a further tick belongs to the flight."""
        return not self.reason and (not self.pilot.painter.finished or self._schedule.watching)

    def disturb(self, *faults: Fault) -> None:
        """Add faults to those of the flight; their delays begin now."""
        self._schedule.add(self.time_s, *faults)

    def sense(self) -> SensorFrame:
        """First half of a tick: faults that are due, and the sensor frame."""
        for text in self._schedule.tick(self.world, self.pilot):
            self._recorder.note(self.time_s, "fault", text)
            if self._log is not None:
                self._log.note("fault", text)
        self._frame = self.world.sense()
        return self._frame

    def advance(self) -> None:
        """Second half of a tick: the pilot's command, the motion under it, the log, and the end of the flight."""
        frame, plant, command = self._frame, self.world.plant, self.command
        seen = self._schedule.seen(frame)
        if seen is not None or command is None:  # without a tick of the pilot its last command stays in force
            command = self.command = self._step(seen or frame)
        self.world.act(command.thrusts)
        self._recorder.tick(frame, command)
        if self._log is not None:
            self._log.tick(frame.stamp_ns)
        self.ticks += 1
        if plant.crashed:
            self.reason = f"{CRASH}: {plant.crashed}"
        elif plant.landed:
            self.reason = LANDED
        elif self.time_s > self.limit_s:
            self.reason = f"{TIME_OUT} after {self.limit_s:.0f} s of flight"

    def close(self) -> None:
        """Close window and MCAP log; the flight is over."""
        self.world.close()
        if self._log is not None and (problem := self._log.close()):
            self._recorder.note(self.time_s, "log", problem)

    def trace(self) -> Trace:
        """The flight so far as a trace; called once, at its end."""
        trace, painter, reason = self._recorder.trace(), self.pilot.painter, self.reason
        planned = not reason or (reason == LANDED and painter.descending)
        trace.claimed = planned and (painter.finished or bool(reason)) and not painter.failed
        trace.reason, trace.plan = reason or painter.reason, self._job.plan
        if isinstance(self._job, OwnJob):
            trace.legs = self._legs
        if reason:
            trace.events.append(Event(t=self.time_s, kind="end", text=reason))
        return trace


def fly(
    scene: Scene,
    options: FlightOptions,
    progress: Progress | None = None,
    config: PilotConfig | None = None,
    job: Job | None = None,
    faults: tuple[Fault, ...] = (),
) -> Trace:
    """Fly one scene under one law; Ctrl-C ends the flight and returns the partial trace.

    Args:
        scene: The truth.
        options: Law, seed, features, picture size and so on.
        progress: Called every `PROGRESS_S` with time, phase and real-time factor.
        config: Flown instead of the preset.
        job: Task at the wall; None paints.
        faults: Faults and their times.

    Returns:
        The trace; incomplete with a reason when the flight crashed, timed out or was interrupted, and when it landed
        although its strategy had not ended as planned.
    """
    loop = ClosedLoop(scene, options, config, job, faults)
    start, shown = time.perf_counter(), ticks_in(PROGRESS_S, loop.pilot.config.controller.tick_s)
    try:
        while loop.going:
            loop.sense()
            loop.advance()
            if progress is not None and not loop.reason and loop.ticks % shown == 0:
                flown = loop.time_s
                progress(flown, loop.pilot.painter.phase, flown / max(time.perf_counter() - start, 1e-9))
    except KeyboardInterrupt:
        loop.reason = INTERRUPTED
    finally:
        loop.close()
    trace = loop.trace()
    trace.wall_time_s = time.perf_counter() - start  # includes the trace
    return trace
