"""Where a flown second goes: physics, drawing, sensors, vision, estimation, control and log of a short flight."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

import cv2
import numpy as np

from ibvs_qp.config import ControllerConfig
from sim.bench.timing import Bench, Row, Stopwatch
from sim.flight.closed_loop import make_pilot
from sim.flight.jobs import PaintJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.recorder import Recorder
from sim.flight.surroundings import World
from sim.world.scene import Scene

#: Stages of a tick, in the order in which they run. Estimation is all of the pilot but vision and control.
STAGES = ("drawing", "sensors", "vision", "estimation", "control", "physics", "log")
#: One row of this length is painted [m], in flights no longer than so many ticks.
STROKE_M, LONGEST_FLIGHT = 0.3, 10_000
#: Ticks at the start that are not counted: lazy imports and first allocations fall into them (1 s).
WARM_UP_TICKS = 250


def bench_loop(seed: int, progress: Callable[[str], None]) -> Bench:
    """Measure a short rendered and a short geometric flight of the QP law, by the wall clock, in one thread.

    Args:
        seed: Of both flights.
        progress: Called with the name of each measurement.

    Returns:
        A row per stage of each flight [us per tick]; `stages_us` per flown second [us]; `ratios` are real-time factors.
    """
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        rows, stages, ratios = [], {}, {}
        for features in ("rendered", "geometric"):
            progress(f"a {features} flight")
            times = stage_times(seed, features)
            flown_s = len(times["physics"]) * ControllerConfig.tick_s
            rows += [Row(name=f"{features}_{stage}", times_us=spent.tolist()) for stage, spent in times.items()]
            stages |= {f"{features}_{stage}": float(spent.sum()) / flown_s for stage, spent in times.items()}
            ratios[f"{features}_real_time"] = 1e6 * flown_s / sum(float(spent.sum()) for spent in times.values())
    finally:
        cv2.setNumThreads(threads)
    return Bench(rows=rows, stages_us=stages, ratios=ratios)


def stage_times(seed: int, features: str) -> dict[str, np.ndarray]:
    """Time of every stage of `STAGES` at every tick of a short flight after its first second [us], (N,) each."""
    scene, options = Scene(), FlightOptions(seed=seed, features=features, video=False, compiled=True)
    scene = dataclasses.replace(scene, paint=dataclasses.replace(scene.paint, rows=1, stroke_m=STROKE_M))
    config, job = pilot_config(scene, options), PaintJob()
    pilot, world = make_pilot(scene, options, config, job), World(scene, options, config)
    recorder = Recorder(scene, options, world, pilot)
    drawing = Stopwatch()
    if world.stream is not None:
        camera = world.stream.camera
        camera.capture = drawing.around("drawing", camera.capture)
    laps, pictures = [], []
    while not pilot.painter.finished and not world.plant.over and len(laps) < LONGEST_FLIGHT:
        drawing.spent, start = {}, time.perf_counter()
        frame = world.sense()
        sensed = time.perf_counter()
        command = pilot.step(frame)
        stepped = time.perf_counter()
        world.act(command.thrusts)
        acted = time.perf_counter()
        recorder.tick(frame, command)
        logged = time.perf_counter()
        if frame.image is not None:
            pictures.append(len(laps))
        parts = sensed - start, stepped - sensed, acted - stepped, logged - acted
        laps.append((1e-6 * drawing.spent.get("drawing", 0.0), *parts))
    drawn, sense, step, act, log = 1e6 * np.array(laps).T
    trace, vision = recorder.trace(), np.zeros(len(laps))
    vision[pictures] = 1e3 * trace.vision_ms
    control = trace.step_us
    spent = (drawn, sense - drawn, vision, step - vision - control, control, act, log)
    return {stage: times[WARM_UP_TICKS:] for stage, times in zip(STAGES, spent, strict=True)}
