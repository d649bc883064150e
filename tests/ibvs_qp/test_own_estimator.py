"""A state that a user's task declares: it follows its equation, starts anew at a reset, and is part of a snapshot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from controller_scenes import measured

from ibvs_qp import HybridController, Reference, preset
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.tasks import Task

TIME_S, TICK_S = 2.0, 0.004
CONFIG = preset("octorotor_qp").controller


class Load(Task):
    """Averages the square of a rotor's thrust."""

    def rows(self, model: Any) -> list[TaskRow]:
        before, load = model.signals.state("load"), model.last_thrust[0] ** 2
        mean = model.signals.remember("load", before + model.body.dt / TIME_S * (load - before))
        model.output("load", mean)
        row = TaskRow(name="cool", unit="N", expression=model.thrust[0], target=0.0, weight=1e-5 * mean)
        return [row]


def controller() -> HybridController:
    return HybridController(CONFIG, tasks=[Load()])


def load(law: HybridController) -> float:
    return law.setpoints.step.outputs["load"].item()


def flown(law: HybridController, first: int, last: int) -> list[np.ndarray]:
    """Thrusts of ticks."""
    return [law.step(measured(tick), Reference(standoff=0.2)).thrusts for tick in range(first, last)]


def test_the_state_follows_its_equation() -> None:
    law = controller()
    (last,) = flown(law, 1, 2)
    expected = load(law)  # before the first command the model assumes hover
    for tick in range(2, 300):
        expected += TICK_S / TIME_S * (last[0] ** 2 - expected)
        (last,) = flown(law, tick, tick + 1)
        assert load(law) == pytest.approx(expected, rel=1e-9)


def test_a_reset_forgets_it_and_a_snapshot_keeps_it() -> None:
    law, other = controller(), controller()
    begin = flown(law, 1, 100)
    other.restore(law.state())
    assert np.array_equal(flown(law, 100, 150), flown(other, 100, 150)) and load(law) == load(other) > 1.0
    law.reset()
    assert np.array_equal(flown(law, 1, 100), begin)
