"""A contact that the caller estimates, and the feedforward of friction and moment before they are felt."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest
from controller_scenes import CEILING, FLOOR
from small_vehicle import SmallVehicle
from symbolic_block import Block

from ibvs_qp import HybridController, Outcome, PaperController, Reference
from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.inputs import Body, Contact
from ibvs_qp.model.feedforward import contact_feedforward

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


CONFIG, TICK = ControllerConfig(), 0.004
PUSH, FRICTION = 5.0, 0.3
TIP = np.array(CONFIG.vehicle.tip_position_m)


def feedforward() -> Block:
    """The feed-forward on its own: force (3), moment (3), felt moment (3)."""

    def build(signals):
        body, touch = Body.of(signals), Contact.of(signals)
        made = contact_feedforward(signals, CONFIG, body, touch, signals.input("travel", 3), ca.SX(FRICTION))
        return ca.vertcat(made.force, made.moment, made.felt_moment)

    block = Block(build)
    block.contact(touching=1.0, push=PUSH)
    return block


def climb(seconds: float, felt: bool = True) -> np.ndarray:
    """A climb whose friction answers as late as the motors push: force, moment, felt moment, true moment per tick."""
    vehicle, block = CONFIG.vehicle, feedforward()
    share = 1.0 - math.exp(-TICK / vehicle.motor_lag_s)
    answer, rows = np.zeros(3), []
    for _ in range(round(seconds / TICK)):
        wrench = np.concatenate((answer, np.cross(TIP, answer))) if felt else np.zeros(6)
        out = block(contact_wrench=wrench, travel=(0.0, 0.0, -0.05))
        answer = answer + share * (out[:3] - answer)
        rows.append(np.concatenate((out, np.cross(TIP, out[:3]))))
    return np.array(rows)


def test_friction_comes_with_its_moment_at_once() -> None:
    """Force and moment reach the rotors together; the felt moment alone comes as late as motors and filter."""
    rows = climb(0.6)
    final = CONFIG.contact.friction_gain * FRICTION * PUSH
    np.testing.assert_allclose(rows[-1, :3], (0.0, 0.0, final), atol=1e-9)  # down, against the climb
    assert np.abs(rows[:, 3:6] - rows[:, 9:]).max() < 0.06 * abs(rows[-1, 10])
    assert np.abs(rows[:, 6:9] - rows[:, 9:]).max() > 0.3 * abs(rows[-1, 10])


def test_the_measured_moment_has_the_last_word() -> None:
    rows = climb(2.0, felt=False)
    assert np.abs(rows[:, 4]).max() > 0.2
    np.testing.assert_allclose(rows[-1, 3:6], 0.0, atol=1e-6)


def test_free_air_feeds_nothing_forward() -> None:
    block = feedforward()
    block.contact(touching=0.0)
    np.testing.assert_array_equal(block(travel=(0.0, 0.1, 0.0)), 0.0)
    assert block.step.outputs["value"][:3] == pytest.approx(np.zeros(3))
