"""Flights for the closed-loop tests: short jobs, holds, and runs of the pilot without a camera."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from ibvs_qp.pilot import Pilot
from ibvs_qp.pilot.painting.command import PainterInput, PaintingCommand
from ibvs_qp.pilot.painting.painter import Painter
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.flight.trace import Trace
from sim.world.scene import Scene, WallScene


def short_scene(stroke_m: float = 0.5, rows: int = 2, **sections: Any) -> Scene:
    """The default scene with a short stroke, for flights of half a minute."""
    scene = Scene(**sections)
    paint = dataclasses.replace(scene.paint, stroke_m=stroke_m, rows=rows)
    board = dataclasses.replace(scene.board, width_m=stroke_m + 2.0 * paint.edge_margin_m)
    return dataclasses.replace(scene, paint=paint, board=board)


def wall(**changes: Any) -> WallScene:
    return dataclasses.replace(WallScene(), **changes)


def fly_geometric(scene: Scene, law: str = "qp", seed: int = 0) -> tuple[Trace, dict[str, Any]]:
    trace = fly(scene, FlightOptions(law=law, seed=seed, features="geometric", video=False))
    return trace, compute_metrics(trace)


class HoldPainter(Painter):
    """Presses like the painter and then stays where it is."""

    def __init__(self, config: Any, hold_s: float) -> None:
        self._hold_s = hold_s
        super().__init__(config)

    def _paint(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        if inputs.time_s - self.entered > self._hold_s:
            self._enter(inputs, "retreat", "held")
        return self._on_the_wall(hold=True)


def hold(scene: Scene, law: str, hold_s: float, seed: int = 0) -> dict[str, np.ndarray]:
    """Press and hold; arrays over the hold: true push, roll, pitch, yaw [deg], tip (y, z) [m], contact at 1 kHz."""
    options = FlightOptions(law=law, seed=seed, features="geometric", video=False)
    config = pilot_config(scene, options)
    pilot, world = Pilot(config), World(scene, options, config)
    pilot.painter = HoldPainter(config.painting, hold_s)
    rows: dict[str, list[Any]] = {"push": [], "euler_deg": [], "tip": [], "contact": []}

    def note() -> None:
        if pilot.painter.phase != "paint":
            return
        rows["push"].append(world.plant.contact_normal_force)
        rows["euler_deg"].append(np.degrees(world.plant.euler))
        rows["tip"].append(world.plant.tip[1:])
        rows["contact"].append(np.array(world.plant.pushes))

    run(pilot, world, lambda: pilot.painter.finished, note)
    return {name: np.array(values) for name, values in rows.items()}


def run(pilot: Pilot, world: World, done: Callable[[], bool], note: Callable[[], None], limit_s: float = 90.0) -> None:
    """Step pilot and world until done, crashed or out of time."""
    for _ in range(int(limit_s / 0.004)):
        world.act(pilot.step(world.sense()).thrusts)
        assert world.plant.crashed is None, world.plant.crashed
        note()
        if done():
            return
    raise AssertionError(f"not done after {limit_s} s, in phase {pilot.painter.phase}")
