"""Thrust window and clipping: never outside the box, never faster than the rate, whatever limits are reported."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from controller_scenes import CEILING, FLOOR
from hypothesis import given, settings
from hypothesis import strategies as st

from ibvs_qp.model.reach import LEAST_GAP, thrust_window
from ibvs_qp.model.reporting import clip

BOX = np.full(1, FLOOR), np.full(1, CEILING)
STEP = 2.0
LIMIT = st.floats(-100.0, 200.0)


@settings(max_examples=300, deadline=None)
@given(st.floats(FLOOR, CEILING), LIMIT, LIMIT)
def test_the_window_lies_within_box_and_rate(last: float, lower: float, upper: float) -> None:
    low, high = thrust_window(np.full(1, last), np.full(1, lower), np.full(1, upper), STEP, *BOX)
    assert low[0] >= FLOOR and high[0] <= CEILING and low[0] < high[0]
    assert low[0] >= last - STEP - LEAST_GAP and high[0] <= last + STEP + LEAST_GAP


@pytest.mark.parametrize(
    ("lower", "upper", "window"),
    [
        (FLOOR, CEILING, (18.0, 22.0)),
        (19.0, 21.0, (19.0, 21.0)),
        (FLOOR, 5.0, (18.0, 18.0)),
        (40.0, CEILING, (22.0, 22.0)),
    ],
)
def test_a_limit_out_of_reach_is_approached_at_the_rate(
    lower: float, upper: float, window: tuple[float, float]
) -> None:
    found = thrust_window(np.full(1, 20.0), np.full(1, lower), np.full(1, upper), STEP, *BOX)
    assert [side.item() for side in found] == pytest.approx(window, abs=2.0 * LEAST_GAP)


def test_thrusts_are_clipped_on_both_sides() -> None:
    window = SimpleNamespace(lower=np.full(4, 2.0), upper=np.full(4, 9.0))
    found = clip(window, np.array([-5.0, 1.9, 2.5, 100.0]))  # type: ignore[arg-type]
    assert found.tolist() == [2.0, 2.0, 2.5, 9.0]
