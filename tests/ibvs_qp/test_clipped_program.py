"""The ablation that clips after the program: the same where nothing binds, and what it loses where something does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import line_references
from small_vehicle import SmallVehicle

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference

WITHIN = ControllerConfig(reach_check=False)
CLIPPED = replace(WITHIN, thrust_rows=False)
VEHICLE = WITHIN.vehicle


def press(config: ControllerConfig, push: float, ticks: int):
    """Last command of a press by a vehicle of its own."""
    controller, vehicle = HybridController(config), SmallVehicle(config, distance=0.005)
    reference = Reference(push_force=push, standoff=0.02, contact=True, lines=line_references(1))
    command = None
    for _ in range(ticks):
        command = controller.step(vehicle.measure(count=1), reference)
        assert (command.thrusts >= VEHICLE.thrust_min).all() and (command.thrusts <= VEHICLE.thrust_max).all()
        vehicle.fly(command.thrusts)
    assert command is not None
    return command


def test_the_same_thrusts_where_no_limit_binds() -> None:
    within, clipped = press(WITHIN, 5.0, 400), press(CLIPPED, 5.0, 400)
    assert not within.active_limits and not clipped.active_limits
    np.testing.assert_allclose(clipped.thrusts, within.thrusts, atol=1e-6)


@pytest.mark.slow
def test_clipping_gives_up_lift_and_level_where_the_program_gives_up_push() -> None:
    """While 20 N are pressed every rotor is limited to 20 N; 40 ms later the program still carries the weight."""
    lost = {}
    for name, config in (("within", WITHIN), ("clipped", CLIPPED)):
        controller, vehicle = HybridController(config), SmallVehicle(config, distance=0.005)
        reference = Reference(push_force=20.0, standoff=0.02, contact=True, lines=line_references(1))
        before, command = np.zeros(6), None
        for tick in range(1211):
            limit = {"thrust_max": np.full(6, 20.0)} if tick >= 1200 else {}
            command = controller.step(vehicle.measure(count=1, **limit), reference)
            vehicle.fly(command.thrusts)
            before = command.wrench if tick == 1199 else before
        assert command is not None
        assert any(limit.name.startswith("thrust_") for limit in command.active_limits)
        assert np.abs(command.unallocated_wrench).max() > 1.0
        lost[name] = np.abs(command.wrench - before)
    assert lost["within"][2] < 1.0 and lost["within"][4] < 0.05  # the level rows answer the push that falls
    assert lost["clipped"][2] > 3.0 and lost["clipped"][4] > 0.3
