"""Normals of a depth camera with mirrored axes."""

import math

import numpy as np
import pytest

from ibvs_qp.estimation.normal_turns import NormalTurns


def turned(sign: float, amplitude_deg: float, seed: int = 0, noise_deg: float = 0.6) -> NormalTurns:
    """Ten seconds of yaw back and forth at 30 Hz, seen with a sign and with the noise of a fitted plane."""
    turns, random = NormalTurns(), np.random.default_rng(seed)
    for k in range(300):
        yaw = math.radians(amplitude_deg) * math.sin(k / 30.0)
        seen = -sign * yaw + math.radians(noise_deg) * random.normal()
        turns.add(k * 33_333_333, (math.cos(seen), math.sin(seen), 0.0), yaw)
    return turns


@pytest.mark.parametrize("seed", range(20))
def test_a_normal_that_turns_against_the_gyro_is_mirrored_and_a_right_one_never(seed):
    assert turned(-1.0, 8.0, seed).mirrored
    assert not turned(1.0, 8.0, seed).mirrored
    assert not turned(1.0, 0.0, seed).mirrored, "noise alone"


def test_reset_forgets():
    turns = turned(-1.0, 8.0)
    turns.reset()
    assert not turns.mirrored
