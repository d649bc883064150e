"""A contact that the caller estimates and hands to the controller."""

from __future__ import annotations

import math

import numpy as np
import pytest
from controller_scenes import CEILING, FLOOR
from small_vehicle import SmallVehicle

from ibvs_qp import HybridController, Outcome, PaperController, Reference

LAWS = [HybridController, PaperController]
PRESS = Reference(push_force=5.0, contact=True)


@pytest.mark.parametrize("law", LAWS)
def test_the_own_estimate_handed_on_gives_the_same_thrusts(law: type) -> None:
    one, two, vehicle = law(), law(), SmallVehicle(law().config, distance=0.02)
    for _ in range(200):
        measurement = vehicle.measure(0)
        command = one.step(measurement, PRESS)
        handed_on = two.step(measurement, PRESS, one.setpoints.contact)
        np.testing.assert_array_equal(command.thrusts, handed_on.thrusts)
        vehicle.fly(command.thrusts)


@pytest.mark.parametrize("law", LAWS)
def test_a_contact_that_is_none_is_rejected_by_name(law: type) -> None:
    one, two = law(), law()
    measurement = SmallVehicle(one.config).measure(0)
    command, other = one.step(measurement, PRESS), two.step(measurement, PRESS, "wall")
    assert "contact: not a ContactState" in other.rejected
    np.testing.assert_array_equal(command.thrusts, other.thrusts)


@pytest.mark.parametrize("law", LAWS)
def test_a_contact_without_numbers_never_flies(law: type) -> None:
    controller = law()
    measurement = SmallVehicle(controller.config).measure(0)
    controller.step(measurement, PRESS)
    lost = controller.setpoints.contact._replace(distance=math.nan, rate=math.nan)
    later = SmallVehicle(controller.config)
    later.tick = 1
    command = controller.step(later.measure(0), PRESS, lost)
    assert np.isfinite(command.thrusts).all() and FLOOR <= command.thrusts.min() <= command.thrusts.max() <= CEILING
    assert command.outcome is Outcome.HOLD
