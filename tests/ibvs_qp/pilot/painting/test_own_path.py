"""The example of an own strategy paints its L on a wall of lines, by edges where they are in view."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from painted_wall import END, NEAR, PaintedWall, short

OWN_PATH = runpy.run_path(str(Path(__file__).parents[4] / "examples" / "own_path.py"))["OwnPath"]


def flown(**changes: Any) -> tuple[PaintedWall, dict[int, np.ndarray]]:
    """The flight, and places of the tip (right, down) in both legs, (N, 2) [m] each."""
    config = short()
    world = PaintedWall(config, painter=OWN_PATH(config), **changes)
    start, legs = world.tip.copy(), {1: [], 2: []}
    for _ in range(15000):
        world.step()
        if world.painter.finished:
            break
        if world.painter.phase == "paint":
            legs[world.painter.row].append(world.to_wall(*(world.tip - start)))
    return world, {leg: np.array(places) for leg, places in legs.items()}


@pytest.mark.parametrize(
    "changes",
    [{}, {"noise": 1e-3, "drift": (1e-3, -1e-3)}, {"tip": np.array((0.03, 0.08))}, {"hidden": {NEAR, END}}],
    ids=["plain", "noise and drift", "start beside the corner", "no upright edge"],
)
def test_both_legs_are_as_long_as_asked(changes: dict[str, Any]) -> None:
    world, legs = flown(**changes)
    assert world.painter.finished and not world.painter.failed and world.painter.reason == "L painted"
    assert world.phases() == ["approach", "press", "paint", "paint", "retreat", "done"]
    for leg, asked in zip(legs.values(), world.painter.legs, strict=True):
        assert leg[-1] - leg[0] == pytest.approx(asked, abs=0.008)


def test_without_the_lower_edge_nothing_begins() -> None:
    config = short()
    world = PaintedWall(config, painter=OWN_PATH(config), blind_wall=True)
    world.fly(5.0)
    assert world.painter.phase == "start" and not world.in_contact
