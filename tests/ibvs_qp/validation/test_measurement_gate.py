"""What the check of a measurement keeps from tick to tick: a force sample goes with its time, and all begins with the
first attitude."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from controller_scenes import TICK_NS, line_references, measured
from references import good_reference

from ibvs_qp.measurement import LineFeature
from ibvs_qp.validation.measurement import MeasurementGate, ReferenceGate

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


def line(rho: float = 0.1, variance: float = 1e-6) -> LineFeature:
    return LineFeature(rho=rho, theta=0.0, covariance=np.diag((variance, 1e-6)), role="vertical", stamp_ns=TICK_NS)


@pytest.mark.parametrize(
    ("broken", "trusted"),
    [
        ({}, True),
        ({"specific_force": None, "velocity": None, "plane": None, "thrust_max": np.full(6, 40.0)}, True),
        ({"lines": (line(),), "attitude_stamp_ns": TICK_NS, "imu_stamp_ns": 2 * TICK_NS}, True),
        ({"stamp_ns": TICK_NS}, False),
        ({"stamp_ns": 10**12}, False),
        ({"contact_wrench": np.full(6, 600.0)}, False),
        ({"specific_force": np.full(3, np.nan)}, False),
        ({"attitude": np.array([2.0, 0.0, 0.0, 0.0])}, False),
        ({"velocity": np.full(3, np.inf)}, False),
        ({"plane": (0.0, 0.0, np.nan, -1.0)}, False),
        ({"lines": (line(), line(rho=np.inf))}, False),
        ({"lines": (line(), line(variance=np.nan))}, False),
        ({"lines": (line(),) * 9}, False),
        ({"thrust_min": np.full(6, 3.0), "thrust_max": np.full(6, 2.0)}, False),
    ],
)
def test_a_trusted_measurement_passes_where_no_check_changes_it(broken: dict[str, Any], trusted: bool) -> None:
    gate, twin, given = MeasurementGate(6, 2), MeasurementGate(6, 2), measured(1, **broken)
    for each in (gate, twin):
        assert not each.trust(measured(0)) and each.check(measured(0))[1] == (), "time begins with a check"
    assert gate.trust(given) == trusted
    checked, rejected = twin.check(given)
    assert (checked is given and rejected == ()) or not trusted
    if not trusted:
        assert str(gate.check(given)) == str((checked, rejected)), "nothing is kept of what is refused"
    later = measured(2, attitude=None, contact_wrench=None, imu_stamp_ns="late")
    assert str(gate.check(later)) == str(twin.check(later)), "both replace by the same values"


@pytest.mark.parametrize(
    ("broken", "trusted"),
    [
        ({}, True),
        ({"push_force": -1.0}, False),
        ({"standoff": np.inf}, False),
        ({"velocity": np.full(2, np.nan)}, False),
        ({"tilt": np.full(2, 0.7)}, False),
        ({"lines": 2 * line_references(2)}, False),
        ({"lines": (replace(line_references(1)[0], rho=np.nan),)}, False),
    ],
)
def test_a_trusted_reference_passes_where_no_check_changes_it(broken: dict[str, Any], trusted: bool) -> None:
    gate, twin, given = ReferenceGate(2), ReferenceGate(2), replace(good_reference(), **broken)
    assert gate.trust(given) == trusted
    checked, rejected = twin.check(given)
    assert (checked is given and rejected == ()) == trusted
    if trusted:
        assert str(gate.last) == str(twin.last), "both stay in force where the next one is refused"
    else:
        assert str(gate.last) == str(ReferenceGate(2).last), "a refused reference changes nothing"
