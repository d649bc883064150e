"""Reward of a tick by the simulator's truth: paint, path and push, and the end of the flight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.settings import Checked, setting
from sim.evaluate.paint_plan import band_mask, distance_to_polyline, nominal_plan
from sim.evaluate.truth import PLACE_M
from sim.flight.surroundings import PAINTING_FORCE, World

#: Size of the cells in which painted area is counted [m]: an eighth of the default brush.
CELL_M = 0.01


@dataclass(frozen=True, kw_only=True)
class RewardSettings(Checked):
    """Weights of the terms, all assumed; a second of painting returns about 3, more than its errors can cost."""

    paint: float = setting(100.0, "return of the whole plan painted, as per cent", low=0.0, high=1e6)
    stray: float = setting(50.0, "cost of paint outside the plan, per area of the plan", low=0.0, high=1e6)
    path: float = setting(1.0, "cost of contact 8 mm from the path or farther", "1/s", low=0.0, high=1e6)
    push: float = setting(1.0, "cost of contact with an error of the whole push or more", "1/s", low=0.0, high=1e6)
    crash: float = setting(100.0, "cost of a crash: the return of the whole plan", low=0.0, high=1e6)


class PaintReward:
    """Terms of the reward, tick by tick.

    Args:
        world: The world of the flight.
        settings: Weights.
    """

    def __init__(self, world: World, settings: RewardSettings) -> None:
        self._world, self._settings, board, paint = world, settings, world.scene.board, world.scene.paint
        plan, shape = nominal_plan(world.scene), [math.ceil(size / CELL_M) for size in (board.height_m, board.width_m)]
        self._up = board.height_m - (np.arange(shape[0])[:, None] + 0.5) * CELL_M
        self._along = (np.arange(shape[1]) + 0.5) * CELL_M
        self._planned = band_mask(world.scene, plan, (shape[0], shape[1]), 1.0 / CELL_M)
        self._bare, self._area = np.ones(shape, bool), int(np.count_nonzero(self._planned))
        self._path, self._radius_m, self._push_n = plan.polyline, 0.5 * paint.brush_width_m, paint.push_n
        self._tick_s = world.plant.tick_ns * 1e-9

    def terms(self) -> dict[str, float]:
        """Terms of the tick that the plant has just flown, by the names of `RewardSettings`."""
        plant, weights, push = self._world.plant, self._settings, self._world.plant.contact_normal_force
        terms = {
            "paint": 0.0,
            "stray": 0.0,
            "path": 0.0,
            "push": 0.0,
            "crash": -weights.crash if plant.crashed else 0.0,
        }
        if not push > PAINTING_FORCE:
            return terms
        along, up = self._world.geometry.spot(*plant.tip_on_wall)
        error_m = float(distance_to_polyline(np.array([[along, up]]), self._path)[0])
        terms["push"] = -weights.push * self._tick_s * min(abs(push - self._push_n) / self._push_n, 1.0)
        terms["path"] = -weights.path * self._tick_s * min(error_m / PLACE_M, 1.0)
        if plant.on_board:
            fresh = self._bare & ((self._along - along) ** 2 + (self._up - up) ** 2 <= self._radius_m**2)
            self._bare &= ~fresh
            planned, painted = (int(np.count_nonzero(each)) for each in (fresh & self._planned, fresh))
            terms["paint"] = weights.paint * planned / self._area
            terms["stray"] = -weights.stray * (painted - planned) / self._area
        return terms
