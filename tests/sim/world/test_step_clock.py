"""MuJoCo steps without reading the clock, unless somebody has set a clock of his own."""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import mujoco
import numpy as np

from sim.world.plant import Plant
from sim.world.scene import Scene
from sim.world.step_clock import stop_step_clock


def test_steps_of_the_plant_are_not_timed() -> None:
    plant = Plant(Scene())
    for _ in range(3):
        plant.step(np.full(6, 12.0))
    timer = plant.data.timer[mujoco.mjtTimer.mjTIMER_STEP]
    assert (timer.number, timer.duration) == (12, 0.0)


def test_a_clock_of_ones_own_goes_on() -> None:
    asked = []
    try:
        mujoco.set_mjcb_time(lambda: float(len(asked.append(1) or asked)))
        stop_step_clock.cache_clear()
        assert not stop_step_clock()
        model = mujoco.MjModel.from_xml_string("<mujoco/>")
        mujoco.mj_step(model, mujoco.MjData(model))
        assert asked
    finally:
        mujoco.set_mjcb_time(None)
        stop_step_clock.cache_clear()
        assert stop_step_clock()
