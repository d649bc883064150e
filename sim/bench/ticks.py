"""Measurements and references of closed loops: painting, a press at the limit, a loss of thrust."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from allocation import TAROT_T960
from ibvs_qp.controller import HybridController
from ibvs_qp.interfaces.c_library.recorded import FlightTick, other_solution
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.pilot import PilotConfig
from sim.faults.fault import Fault
from sim.faults.rotors import Derate
from sim.faults.schedule import FaultSchedule
from sim.flight.closed_loop import make_pilot
from sim.flight.jobs import Job, PaintJob, PressJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.world.scene import Scene

#: Longest flight [ticks]: two minutes.
LONGEST_FLIGHT = 30_000

#: Commanded push beyond reach [N].
HARD_PUSH_N = 35.0

#: Length of a press [s].
PRESS_S = 10.0

Tick = tuple[Measurement, Reference]


def recorded_ticks(count: int, seed: int) -> list[Tick]:
    """Measurements and references of closed loops on geometric features, one flight after the other.

    Args:
        count: Number of ticks.
        seed: Of the first flight; later flights use consecutive seeds.

    Returns:
        The ticks, flight after flight; the stamps of every flight start again.
    """
    ticks: list[Tick] = []
    while True:
        for scene, job, faults, reach_check in _flights(Scene()):
            for tick in flown_ticks(scene, seed, job, faults, reach_check):
                ticks.append(tick)
                if len(ticks) >= count:
                    return ticks
        seed += 1


def by_flight(controller: HybridController, ticks: list[Tick]) -> Iterator[Tick]:
    """The ticks one by one; the controller is reset before the first tick of every flight."""
    last = -1
    for measurement, reference in ticks:
        if measurement.stamp_ns <= last:
            controller.reset()
        last = measurement.stamp_ns
        yield measurement, reference


def _flights(scene: Scene) -> Iterator[tuple[Scene, Job, tuple[Fault, ...], bool]]:
    """A paint job, a press beyond reach, a paint job during which a rotor loses thrust."""
    hard = dataclasses.replace(scene, paint=dataclasses.replace(scene.paint, push_n=HARD_PUSH_N))
    yield scene, PaintJob(), (), True
    yield hard, PressJob(hold_s=10.0), (), False
    yield scene, PaintJob(), (Derate(share=0.3, rotor=TAROT_T960.names[0]),), True


def flown_ticks(scene: Scene, seed: int, job: Job, faults: tuple[Fault, ...], reach_check: bool) -> Iterator[Tick]:
    """Ticks of one flight of the QP law on geometric features.

    Args:
        scene: The scene.
        seed: Of the flight.
        job: Job at the wall.
        faults: Injected faults.
        reach_check: Whether the controller reduces a push beyond reach.
    """
    options = FlightOptions(seed=seed, features="geometric", video=False)
    config = pilot_config(scene, options)
    config = dataclasses.replace(config, controller=dataclasses.replace(config.controller, reach_check=reach_check))
    pilot, world = make_pilot(scene, options, config, job), World(scene, options, config)
    schedule = FaultSchedule(faults)
    for _ in range(LONGEST_FLIGHT):
        if pilot.painter.finished or world.plant.over:
            return
        schedule.tick(world, pilot)
        world.act(pilot.step(world.sense()).thrusts)
        if pilot.measurement is not None:
            yield pilot.measurement, pilot.reference


def press_flight(config: PilotConfig, count: int) -> list[FlightTick]:
    """A press at a wall nearby, with a configuration's vehicle and law, and so many ticks at most."""
    scene, options = Scene(), FlightOptions(features="geometric", video=False)
    pilot, world = make_pilot(scene, options, config, PressJob(hold_s=PRESS_S)), World(scene, options, config)
    ticks: list[FlightTick] = []
    while len(ticks) < count and not (pilot.painter.finished or world.plant.over):
        frame = world.sense()
        command = pilot.step(frame)
        world.act(command.thrusts)
        if pilot.measurement is not None:
            other = other_solution(pilot.controller, command)
            ticks.append(FlightTick(frame, pilot.measurement, pilot.reference, command.thrusts, other))
    return ticks
