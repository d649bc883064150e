"""Normals of a depth camera with mirrored axes."""

import math

import numpy as np
import pytest
from symbolic_block import Block

from ibvs_qp.estimation.wall_distance import mirrored_normal
from ibvs_qp.symbolic.logic import wrapped

PERIOD_S = 1.0 / 30.0


def block() -> Block:
    return Block(
        lambda signals: mirrored_normal(
            signals, signals.input("new"), signals.input("since"), signals.input("seen", 3), signals.input("yaw")
        )
    )


def turned(sign: float, amplitude_deg: float, seed: int = 0, noise_deg: float = 0.6, start_deg: float = 0.0) -> bool:
    """Ten seconds of yaw back and forth at 30 Hz, seen with a sign and with the noise of a fitted plane."""
    turns, random, found = block(), np.random.default_rng(seed), False
    for k in range(300):
        yaw = math.radians(amplitude_deg) * math.sin(k / 30.0)
        seen = -sign * yaw + math.radians(noise_deg) * random.normal()
        integrated = math.remainder(math.radians(start_deg) + yaw, math.tau)
        found = bool(turns(new=1.0, since=PERIOD_S, seen=(math.cos(seen), math.sin(seen), 0.0), yaw=integrated)[0])
        turns(new=0.0)  # a tick without a plane
    return found


@pytest.mark.parametrize("seed", range(20))
def test_a_normal_that_turns_against_the_gyro_is_mirrored_and_a_right_one_never(seed):
    assert turned(-1.0, 8.0, seed)
    assert not turned(1.0, 8.0, seed)
    assert not turned(1.0, 0.0, seed), "noise alone"


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_heading_at_which_the_integrated_yaw_wraps_does_not_matter(sign):
    assert turned(sign, 8.0, start_deg=180.0) == (sign < 0.0)


def test_angles_wrap():
    assert [float(wrapped(angle)) for angle in (0.5, 4.0, -4.0)] == pytest.approx([0.5, 4.0 - math.tau, math.tau - 4.0])
