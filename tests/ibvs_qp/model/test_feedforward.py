"""What the contact is about to do to the vehicle: friction along the travel and its moment, before it is felt."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from symbolic_block import Block

from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.inputs import Body, Contact
from ibvs_qp.model.feedforward import contact_feedforward

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
