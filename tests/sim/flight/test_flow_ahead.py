"""Flow worked out beside the pilot is the pilot's own to the bit, whatever becomes of the pictures asked for ahead."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math

import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.vision.flow_ahead import FlowAhead
from ibvs_qp.vision.flow_task import FlowAnswer, FlowTask
from ibvs_qp.vision.flow_worker import FlowWorker
from ibvs_qp.vision.percept import Percept
from ibvs_qp.vision.perception import Perception
from sim.bench.mission import Shot, mission_shots
from sim.flight.closed_loop import FlightOptions, World, make_pilot, pilot_config
from sim.flight.jobs import PaintJob
from sim.world.scene import Scene

VEHICLE, CONFIG = VehicleParams(), PilotConfig().vision


@functools.cache
def shots() -> tuple[Shot, ...]:
    return tuple(mission_shots((424, 240), 16, 2, VEHICLE))


class Desk:
    """A link without a process: every task is done when it is asked for."""

    def __init__(self) -> None:
        self.pictures = [(shot.frame.rgb, shot.frame.depth) for shot in shots()]
        self.worker, self.answers, self.tasks = FlowWorker(), [], []

    def place(self, rgb: np.ndarray) -> int:
        return next(place for place, (own, _) in enumerate(self.pictures) if own is rgb)

    def following(self, place: int) -> tuple[int, int] | None:
        if place + 1 == len(self.pictures):
            return None
        return place + 1, shots()[place + 1].frame.stamp_ns - shots()[place].frame.stamp_ns

    def ask(self, task: FlowTask) -> None:
        self.tasks.append(task)
        self.answers.append(self.worker.run(task, self.pictures))

    def answer(self, number: int) -> FlowAnswer:
        [found] = [answer for answer in self.answers if answer is not None and answer.number == number]
        return found


def seen(case: str, desk: Desk | None) -> list[Percept]:
    """What is seen of all shots that arrive; with a desk, what comes next is asked for after each of them."""
    flow = None if desk is None else FlowAhead(desk, CONFIG.flow)
    eye, percepts = Perception(CONFIG, VEHICLE, flow), []
    for k, shot in enumerate(shots()):
        frame, turn = shot.frame, shot.rotation
        if case == "one never comes" and k == 7:
            continue
        if case == "one is refused" and k == 7:
            frame = dataclasses.replace(frame, intrinsics=(math.nan, 1.0, 1.0, 1.0))
        if case == "another lens" and k >= 7:
            fx, fy, cx, cy = frame.intrinsics
            frame = dataclasses.replace(frame, intrinsics=(1.01 * fx, 1.01 * fy, cx, cy))
        if case == "begins again" and k == 7:
            eye.reset()
        percepts.append(eye.process(frame, attitude=shot.attitude, rotation=turn, velocity=shot.velocity))
        if flow is None or case == "never ahead":
            continue
        stamp = flow.next_stamp(frame.rgb, frame.stamp_ns)
        late = np.full(3, 1e-3 * (case == "the turn is another" and k % 3 == 0))
        flow.look_ahead(frame.rgb, stamp, None if stamp is None else shots()[k + 1].rotation + late)
    return percepts


@pytest.mark.parametrize(
    ("case", "redone"),
    [
        ("all come", 0),
        ("never ahead", 0),
        ("one never comes", 1),
        ("one is refused", 0),
        ("another lens", 1),
        ("begins again", 1),
        ("the turn is another", 5),
    ],
)
def test_the_same_bits_as_here(case: str, redone: int) -> None:
    desk = Desk()
    here, there = seen(case, None), seen(case, desk)
    assert sum(one.features.velocity is not None for one in here) >= 8
    for one, other in itertools.zip_longest(here, there):
        assert (one.refused, one.velocity_refused) == (other.refused, other.velocity_refused)
        for name in ("velocity", "velocity_covariance", "velocity_stamp_ns", "plane"):
            assert np.array_equal(getattr(one.features, name), getattr(other.features, name)), name
        assert [line.rho for line in one.features.lines] == [line.rho for line in other.features.lines]
    asked = sum(task.step is not None for task in desk.tasks)
    assert asked == len(here) + redone, "what was asked for ahead is used"


def test_a_flight_with_the_flow_in_the_drawing_process_changes_no_bit() -> None:
    thrusts, velocities, ahead = {}, {}, []
    for apart in (False, True):
        options = FlightOptions(image_size=(424, 240), camera_process=apart)
        config = pilot_config(Scene(), options)
        world = World(Scene(), options, config)
        try:
            flow = world.flow(config)
            assert (flow is not None) == apart
            if flow is not None:
                ahead = count_steps(world)
            pilot, rows, moved = make_pilot(Scene(), options, config, PaintJob(), flow), [], []
            for _ in range(130):
                command = pilot.step(world.sense())
                world.act(command.thrusts)
                rows.append(command.thrusts)
                moved.append(None if pilot.percept is None else pilot.percept.features.velocity)
        finally:
            world.close()
        thrusts[apart], velocities[apart] = np.array(rows), moved
    assert np.array_equal(thrusts[False], thrusts[True])
    for one, other in zip(velocities[False], velocities[True], strict=True):
        assert (one is None) == (other is None) and (one is None or np.array_equal(one, other))
    assert sum(one is not None for one in velocities[True]) > 50
    assert len(ahead) == len(set(ahead)) >= 14, "every picture is followed into once, before it arrives"


def count_steps(world: World) -> list[int]:
    """Stamps of all steps that the drawing process of a world is asked for, filled as it flies."""
    remote, stamps = world._remote, []
    assert remote is not None
    ask = remote.ask

    def counted(task: FlowTask) -> None:
        if task.step is not None:
            stamps.append(task.step.stamp_ns)
        ask(task)

    remote.ask = counted  # type: ignore[method-assign]
    return stamps
