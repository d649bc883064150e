"""What the check of a measurement keeps from tick to tick: a force sample goes with its time, and all begins with the
first attitude."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from controller_scenes import TICK_NS, measured

from ibvs_qp.validation.measurement import MeasurementGate

FIRST, SECOND = np.arange(6.0), np.arange(6.0) + 10.0


@pytest.mark.parametrize(
    "broken",
    [
        {"contact_wrench": np.full(6, np.nan)},
        {"contact_wrench": None},
        {"contact_wrench": SECOND, "wrench_stamp_ns": None},
        {"contact_wrench": SECOND, "wrench_stamp_ns": 10**12},
    ],
)
def test_value_and_time_of_a_force_sample_go_together(broken: dict[str, Any]) -> None:
    gate = MeasurementGate(6, 2)
    gate.check(measured(0, contact_wrench=FIRST))
    checked, rejected = gate.check(measured(1, **broken))
    assert checked is not None and len(rejected) == 1
    assert checked.contact_wrench.tolist() == FIRST.tolist() and checked.wrench_stamp_ns == TICK_NS
    checked, rejected = gate.check(measured(2, contact_wrench=SECOND))
    assert checked is not None and rejected == ()
    assert checked.contact_wrench.tolist() == SECOND.tolist() and checked.wrench_stamp_ns == 3 * TICK_NS


def test_before_the_first_attitude_all_else_is_named_too_and_nothing_is_kept() -> None:
    gate = MeasurementGate(6, 2)
    checked, rejected = gate.check(measured(1, attitude=None, wrench_stamp_ns=10**12, plane=np.zeros(4)))
    assert checked is None
    assert [reason.split(":")[0] for reason in rejected] == ["attitude", "wrench_stamp_ns", "plane"]
    checked, rejected = gate.check(measured(0))  # earlier than the refused one: time has not begun
    assert checked is not None and rejected == ()
