"""Thrust to motor command and back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.interfaces.px4.thrust_curve import ThrustCurve


@settings(deadline=None)
@example(quadratic=5e-06, voltage=None, ratio=[1.0])
@given(
    quadratic=st.floats(0.0, 1.0),
    voltage=st.one_of(st.none(), st.floats(15.0, 30.0)),
    ratio=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8),
)
def test_commands_give_the_thrusts(quadratic: float, voltage: float | None, ratio: list[float]) -> None:
    curve = ThrustCurve(quadratic=quadratic)
    thrusts = np.array(ratio) * curve.limit(voltage)
    commands = curve.commands(thrusts, voltage)
    assert ((commands >= 0.0) & (commands <= 1.0)).all()
    np.testing.assert_allclose(curve.thrusts(commands, voltage), thrusts, atol=1e-6)


def test_half_the_command_of_a_quadratic_curve_is_a_quarter_of_the_thrust() -> None:
    assert ThrustCurve(thrust_max_n=40.0).thrusts(np.array([0.5])).tolist() == [10.0]
    assert ThrustCurve(thrust_max_n=40.0, quadratic=0.0).thrusts(np.array([0.5])).tolist() == [20.0]


def test_a_sagging_battery_needs_more_command_and_lowers_the_limit() -> None:
    curve = ThrustCurve(thrust_max_n=40.0, full_voltage_v=25.0)
    assert curve.limit(20.0) == pytest.approx(25.6)
    assert curve.commands(np.array([10.0]), 20.0) == pytest.approx(np.sqrt(10.0 / 25.6))


def test_no_thrust_leaves_the_range_of_commands() -> None:
    curve, odd = ThrustCurve(), np.array([-5.0, 1e9, np.nan, np.inf, -np.inf])
    assert curve.commands(odd).tolist() == [0.0, 1.0, 0.0, 1.0, 0.0]


@pytest.mark.parametrize("voltage", [float("nan"), 0.0, -5.0, 1e9, float("inf")])
def test_a_faulty_voltage_neither_stops_nor_drives_the_motors(voltage: float) -> None:
    curve, thrust = ThrustCurve(), np.array([10.0])
    ratio = float(curve.commands(thrust, voltage)[0] / curve.commands(thrust)[0])
    assert 0.9 < ratio < 1.7


def test_impossible_curves_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"quadratic = 1\.5 is refused"):
        ThrustCurve(quadratic=1.5)
