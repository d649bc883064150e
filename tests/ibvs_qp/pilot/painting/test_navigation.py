"""References of the tip's place off the wall."""

from __future__ import annotations

import pytest

from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.navigation import MOST_LEAD_M, Navigation

CONFIG, TICK_S = PaintingConfig(), 0.004


def test_the_reference_waits_for_a_slow_tip_and_the_speed_stays() -> None:
    """An edge that came into view 0.2 m from its reference was followed with all thrust, and the vehicle crashed."""
    for way in (1.0, -1.0):
        navigation = Navigation(CONFIG)
        speeds = [navigation.move_to(way, 0.0, TICK_S)[0] for _ in range(500)]
        assert navigation.u_reference == pytest.approx(way * MOST_LEAD_M)
        assert speeds == pytest.approx([way * CONFIG.survey_speed_m_s] * 500)


def test_the_reference_of_a_tip_that_follows_arrives() -> None:
    navigation = Navigation(CONFIG)
    for _ in range(3000):
        navigation.move_to(1.0, 0.0, TICK_S)
        navigation.along.predict(0.1 * (navigation.u_reference - navigation.along.u))
    assert navigation.u_reference == pytest.approx(1.0) and navigation.move_to(1.0, 0.0, TICK_S) == (0.0, 0.0)
