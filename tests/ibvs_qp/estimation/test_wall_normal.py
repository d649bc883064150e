"""Normals that disagree with the gyro: refused at first, taken after a third of a second, twice at most; gaps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimators import ContactEstimator

from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.wall_distance import AGREED_PLANES, GAP_S, MOST_REOPENED, ODD_PLANES

TICK_S, TICK_NS = 0.004, 4_000_000
CONFIG = ControllerConfig()
AHEAD = CONFIG.vehicle.tip_position_m[0] - CONFIG.vehicle.camera_position_m[0]
DISTANCE = 0.3
GRAVITY = (0.0, 0.0, -9.81)


def plane(degrees: float, distance: float = DISTANCE) -> tuple[float, float, float, float]:
    """A wall turned about the vertical axis, at a distance of the tip along its normal."""
    yaw = math.radians(degrees)
    depth = distance + AHEAD * math.cos(yaw)
    return math.sin(yaw) / depth, 0.0, math.cos(yaw) / depth, -1.0


class Watched:
    """A vehicle at rest that is shown one plane per tick."""

    def __init__(self) -> None:
        self.estimator, self.tick = ContactEstimator(CONFIG), 0

    def show(self, degrees: float, planes: int = 1, distance: float = DISTANCE, pause: int = 1) -> float:
        """Angle of the normal afterwards [deg]."""
        for _ in range(planes):
            self.tick += pause
            self.wall = self.estimator.update(
                stamp_ns=self.tick * TICK_NS,
                specific_force=GRAVITY,
                plane=plane(degrees, distance),
                plane_stamp_ns=self.tick * TICK_NS,
            )
        return math.degrees(math.atan2(self.wall.normal[1], self.wall.normal[0]))


def test_a_normal_that_disagrees_is_refused_until_it_lasts() -> None:
    seen = Watched()
    assert seen.show(0.0, 20) == pytest.approx(0.0)
    accepted = seen.estimator.plane_ns
    assert seen.show(-25.0, ODD_PLANES - 1) == pytest.approx(0.0, abs=1e-9)
    assert seen.estimator.plane_ns == accepted
    assert seen.show(-25.0) == pytest.approx(-25.0, abs=1e-6)
    assert seen.estimator.plane_ns > accepted


def test_one_that_agrees_in_between_begins_the_count_anew() -> None:
    seen = Watched()
    seen.show(0.0, 20)
    for _ in range(5):
        assert seen.show(-25.0, ODD_PLANES - 1) == pytest.approx(0.0, abs=1e-9)
        seen.show(0.0)


def test_it_is_taken_twice_and_then_no_more_until_many_agreed() -> None:
    seen = Watched()
    seen.show(0.0, 20)
    for number in range(MOST_REOPENED):
        angle = -25.0 if number % 2 == 0 else 0.0
        assert seen.show(angle, ODD_PLANES) == pytest.approx(angle, abs=1e-6)
    last, other = (0.0, -25.0) if MOST_REOPENED % 2 == 0 else (-25.0, 0.0)
    assert seen.show(other, 5 * ODD_PLANES) == pytest.approx(last, abs=1e-6)
    seen.show(last, AGREED_PLANES)
    assert seen.show(other, ODD_PLANES) == pytest.approx(other, abs=1e-6)


def test_after_a_gap_the_next_plane_counts_as_the_first() -> None:
    seen = Watched()
    seen.show(0.0, 20)
    gap = round(GAP_S / TICK_S) + 1
    assert seen.show(-25.0, distance=0.6, pause=gap) == pytest.approx(-25.0, abs=1e-6)
    assert seen.wall.distance == pytest.approx(0.6, abs=1e-6)
    known = Watched()
    known.show(0.0, 20)
    assert known.show(-25.0, distance=0.6, pause=gap - 2) == pytest.approx(0.0, abs=1e-9)
    assert np.isclose(known.wall.distance, DISTANCE, atol=0.01)
