"""One flight: plant, sensors, camera and pilot in one deterministic loop."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.pilot import Pilot, PilotConfig
from sim.faults.fault import Fault
from sim.faults.schedule import FaultSchedule
from sim.flight.jobs import Job, OwnJob, PaintJob
from sim.flight.options import FlightOptions, pilot_config, ticks_in
from sim.flight.own_law import own_law
from sim.flight.recorder import Recorder
from sim.flight.surroundings import World
from sim.flight.trace import CRASH, INTERRUPTED, LANDED, Event, Trace
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
    config, job = pilot_config(scene, options, config), job or PaintJob()
    pilot, world = make_pilot(scene, options, config, job), World(scene, options, config)
    legs = tuple((float(right), float(down)) for right, down in pilot.painter.legs)
    recorder, schedule = Recorder(scene, options, world, pilot), FaultSchedule(faults, options.seed)
    log = open_mcap(options, world, pilot)
    fly_tick = pilot.step if log is None else log.step
    limit = BASE_TIME + STROKE_FACTOR * job.expected_s(config.painting, BoardGeometry(scene).strokes)
    start, reason, tick, shown = time.perf_counter(), "", 0, ticks_in(PROGRESS_S, config.controller.tick_s)
    try:
        command = None
        while not pilot.painter.finished or schedule.watching:
            for text in schedule.tick(world, pilot):
                recorder.note(world.plant.time_ns * 1e-9, "fault", text)
                if log is not None:
                    log.note("fault", text)
            frame = world.sense()
            seen = schedule.seen(frame)
            if seen is not None or command is None:  # without a tick of the pilot its last command stays in force
                command = fly_tick(seen or frame)
            world.act(command.thrusts)
            recorder.tick(frame, command)
            if log is not None:
                log.tick(frame.stamp_ns)
            tick += 1
            if world.plant.crashed:
                reason = f"{CRASH}: {world.plant.crashed}"
                break
            if world.plant.landed:
                reason = LANDED
                break
            if world.plant.time_ns * 1e-9 > limit:
                reason = f"time-out after {limit:.0f} s of flight"
                break
            if progress is not None and tick % shown == 0:
                flown = world.plant.time_ns * 1e-9
                progress(flown, pilot.painter.phase, flown / max(time.perf_counter() - start, 1e-9))
    except KeyboardInterrupt:
        reason = INTERRUPTED
    finally:
        world.close()
        if log is not None and (problem := log.close()):
            recorder.note(world.plant.time_ns * 1e-9, "log", problem)
    trace = recorder.trace()
    trace.wall_time_s = time.perf_counter() - start  # includes the trace
    planned = not reason or (reason == LANDED and pilot.painter.descending)
    trace.claimed = planned and (pilot.painter.finished or bool(reason)) and not pilot.painter.failed
    trace.reason, trace.plan = reason or pilot.painter.reason, job.plan
    if isinstance(job, OwnJob):
        trace.legs = legs
    if reason:
        trace.events.append(Event(t=world.plant.time_ns * 1e-9, kind="end", text=reason))
    return trace
