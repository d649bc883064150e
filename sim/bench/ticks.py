"""Ticks of real closed loops, recorded as a controller sees them: painting, presses at the limit, lost thrust."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from allocation.geometry import TAROT_T960
from ibvs_qp.measurement import Measurement, Reference
from sim.flight.closed_loop import FlightOptions, World, make_pilot, pilot_config
from sim.flight.faults import Derate, Fault, FaultSchedule
from sim.flight.jobs import Job, PaintJob, PressJob
from sim.world.scene import Scene

#: A flight that lasts longer is cut [ticks]: two minutes.
LONGEST_FLIGHT = 30_000

#: Push asked for where it is beyond reach [N].
HARD_PUSH_N = 35.0

Tick = tuple[Measurement, Reference]


def recorded_ticks(count: int, seed: int) -> list[Tick]:
    """Measurements and references of closed loops on geometric features, one flight after the other.

    Args:
        count: How many ticks.
        seed: Of the first flight; the next ones count on.

    Returns:
        The ticks, flight after flight; stamps begin anew with each.
    """
    ticks: list[Tick] = []
    while True:
        for scene, job, faults, reach_check in _flights(Scene()):
            for tick in flown_ticks(scene, seed, job, faults, reach_check):
                ticks.append(tick)
                if len(ticks) >= count:
                    return ticks
        seed += 1


def _flights(scene: Scene) -> Iterator[tuple[Scene, Job, tuple[Fault, ...], bool]]:
    """The mix: a paint job, a press beyond reach, a paint job with a rotor that loses thrust on the way."""
    hard = dataclasses.replace(scene, paint=dataclasses.replace(scene.paint, push_n=HARD_PUSH_N))
    yield scene, PaintJob(), (), True
    yield hard, PressJob(hold_s=10.0), (), False
    yield scene, PaintJob(), (Derate(share=0.3, rotor=TAROT_T960.names[0]),), True


def flown_ticks(scene: Scene, seed: int, job: Job, faults: tuple[Fault, ...], reach_check: bool) -> Iterator[Tick]:
    """Ticks of one flight of the QP law on geometric features.

    Args:
        scene: The truth.
        seed: Of the flight.
        job: What is done at the wall.
        faults: What goes wrong.
        reach_check: Whether a push beyond reach is reduced.
    """
    options = FlightOptions(seed=seed, features="geometric", video=False)
    config = pilot_config(scene, options)
    config = dataclasses.replace(config, controller=dataclasses.replace(config.controller, reach_check=reach_check))
    pilot, world, schedule = (
        make_pilot(scene, options, config, job),
        World(scene, options, config),
        FaultSchedule(faults),
    )
    for _ in range(LONGEST_FLIGHT):
        if pilot.painter.finished or world.plant.crashed:
            return
        schedule.tick(world, pilot)
        world.act(pilot.step(world.sense()).thrusts)
        if pilot.measurement is not None:
            yield pilot.measurement, pilot.reference
