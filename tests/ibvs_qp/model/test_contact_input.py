"""A contact that the caller estimates and hands to the controller."""

from __future__ import annotations

import math
from typing import Any

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


UNSOUND: list[dict[str, Any]] = [
    {"distance": math.nan},
    {"rate": math.inf},
    {"push": 1e300},
    {"ramp": "1"},
    {"stiffness": 10**400},
    {"normal": (0.0, 0.0, 0.0)},
    {"normal": (1.0, 0.0)},
    {"normal": np.array([1.0, 0.0, 0.0])},
    {"contact_weight": np.zeros(2)},
    {"known": None},
    {"known": np.zeros(3)},
    {"known": 10**400},
    {"normal": (10**400, 0.0, 0.0)},
    {"depth": math.inf},
]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("unsound", UNSOUND)
def test_an_unsound_contact_is_named_and_estimated_here_instead(law: type, unsound: dict[str, Any]) -> None:
    controller, alone = law(), law()
    vehicle = SmallVehicle(controller.config)
    controller.step(vehicle.measure(0), PRESS)
    known = controller.setpoints.contact
    assert known.known
    for tick in range(1, 150):
        controller.step(vehicle.measure(0, stamp_ns=tick * 4_000_000 + 4_000_000), PRESS, known._replace(distance=0.05))
    later = vehicle.measure(0, stamp_ns=604_000_000)
    command = controller.step(later, PRESS, known._replace(**unsound))
    assert command.rejected[:1] == ("contact: not finite, or its normal has not length 1",)
    assert np.isfinite(command.thrusts).all() and FLOOR <= command.thrusts.min() <= command.thrusts.max() <= CEILING
    assert command.outcome is Outcome.SOLVED
    alone.step(later, PRESS)
    assert controller.setpoints.contact == alone.setpoints.contact, "as after a start: the last estimate was too old"
