"""Friction of brush and wall from synthetic strokes, and what a held tip teaches."""

from __future__ import annotations

import numpy as np
import pytest
from symbolic_block import Block

from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.friction import ASSUMED_FRICTION, FRICTION_RANGE, estimated_friction
from ibvs_qp.estimation.inputs import Body, Contact

#: Place of the tip, ahead of the centre of mass and above it [m].
TIP = (0.6, 0.0, -0.1)
SETTINGS = ControllerConfig().contact
RISE = SETTINGS.friction_rise_1_s
TICK_S = 0.004
#: Most ticks that a tip may stand without counting as stuck.
PATIENT_TICKS = round(SETTINGS.friction_patience_s / TICK_S) - 1


def estimator(travel: float = 0.1) -> Block:
    """The estimator on its own, travelling to the right against the wall."""

    def build(signals):
        body, touch = Body.of(signals), Contact.of(signals)
        tip = body.velocity_of(TIP)
        return estimated_friction(signals, SETTINGS, body, touch, tip, signals.input("travel", 3), 0.01)[1]

    block = Block(build)
    block.contact(touching=1.0)
    block.step.inputs["travel"][:] = 0.0, travel, 0.0
    return block


def slide(block: Block, push: float, force: float, speed: float, ticks: int) -> float:
    block.contact(push=push)
    wrench = np.array([-push, -force, 0.0, 0.0, 0.0, 0.0])
    for _ in range(ticks):
        block(contact_wrench=wrench, velocity=(0.0, speed, 0.0))
    return float(block.step.outputs["value"][0])


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.8])
def test_friction_while_sliding(friction: float) -> None:
    rng, block = np.random.default_rng(1), estimator()
    for _ in range(1500):
        slide(block, 5.0 + rng.normal(0.0, 0.3), friction * 5.0 + rng.normal(0.0, 0.3), 0.1, 1)
    assert float(block.step.outputs["value"][0]) == pytest.approx(friction, abs=0.03)


def test_nothing_is_learnt_while_slow_or_barely_touching_or_free() -> None:
    block = estimator(travel=0.009)  # below the speed that means sliding: a still tip is not held by friction
    for push, speed in ((5.0, 0.0), (5.0, -0.1), (0.5, 0.1), (0.0, 0.1)):
        assert slide(block, push, 4.0, speed, 500) == ASSUMED_FRICTION
    free = estimator()
    free.contact(touching=0.0)
    assert slide(free, 5.0, 4.0, 0.1, 500) == ASSUMED_FRICTION


def test_friction_is_learnt_in_a_slide_as_slow_as_its_command() -> None:
    block = estimator(travel=0.012)
    assert slide(block, 5.0, 4.0, 0.004, PATIENT_TICKS) == ASSUMED_FRICTION  # slower than half its command
    assert slide(block, 5.0, 4.0, 0.012, 500) == pytest.approx(0.8, abs=0.02)


def test_a_held_tip_raises_the_belief_until_it_breaks_away() -> None:
    block = estimator()
    assert slide(block, 5.0, 1.5, 0.0, PATIENT_TICKS) == ASSUMED_FRICTION
    halfway = 0.5 * (FRICTION_RANGE[1] - ASSUMED_FRICTION)
    ticks = round(halfway / RISE / TICK_S)
    assert slide(block, 5.0, 1.5, 0.0, ticks) == pytest.approx(ASSUMED_FRICTION + halfway, abs=0.01)
    assert slide(block, 5.0, 1.5, 0.0, 2500) == FRICTION_RANGE[1]


def test_a_vehicle_that_turns_about_a_held_tip_learns_nothing_from_its_growing_force() -> None:
    """Its centre of mass moves to the right by 0.05 m/s, its tip stands: the force is what we push, not friction."""
    block, speed = estimator(), 0.05
    turn = (0.0, 0.0, -speed / TIP[0])
    block.contact(push=5.0)
    for force in np.linspace(0.0, 1.5, PATIENT_TICKS):
        block(contact_wrench=(-5.0, -force, 0.0, 0.0, 0.0, 0.0), velocity=(0.0, speed, 0.0), angular_velocity=turn)
    assert float(block.step.outputs["value"][0]) == ASSUMED_FRICTION


def test_friction_stays_plausible() -> None:
    block = estimator()
    assert slide(block, 2.0, 50.0, 0.1, 3000) == pytest.approx(FRICTION_RANGE[1])
    assert slide(block, 2.0, -50.0, 0.1, 3000) == pytest.approx(FRICTION_RANGE[0])


def test_a_noisy_velocity_delays_the_rise_but_does_not_begin_the_wait_anew() -> None:
    """A tip that stands, with a velocity of 9 mm/s in one sample of ten: above the bound of a stuck one."""
    block, ticks = estimator(), round(1.0 / TICK_S)
    for tick in range(ticks):
        slide(block, 5.0, 1.5, 0.009 if tick % 10 == 9 else 0.0, 1)
    clean = estimator()
    assert slide(block, 5.0, 1.5, 0.0, 1) - ASSUMED_FRICTION > 0.7 * (
        slide(clean, 5.0, 1.5, 0.0, ticks) - ASSUMED_FRICTION
    )


@pytest.mark.parametrize("commanded", [0.0, 0.005])
def test_a_commanded_stop_begins_the_wait_anew(commanded: float) -> None:
    block = estimator()
    held = slide(block, 5.0, 1.5, 0.0, 2 * PATIENT_TICKS)
    block.step.inputs["travel"][:] = 0.0, commanded, 0.0
    assert slide(block, 5.0, 0.0, 0.0, 1) == held
    block.step.inputs["travel"][:] = 0.0, -0.1, 0.0
    assert slide(block, 5.0, -1.5, 0.0, PATIENT_TICKS) == held


def test_a_tip_that_has_broken_away_raises_nothing() -> None:
    block = estimator()
    held = slide(block, 5.0, 1.5, 0.0, 4 * PATIENT_TICKS)
    assert slide(block, 5.0, 1.5, 0.015, PATIENT_TICKS) == held  # too slow to be measured, too fast to be stuck
