"""States of the step function: they move on only while all of them are numbers."""

from __future__ import annotations

import math

import casadi as ca
import pytest

from ibvs_qp.symbolic.function import StepFunction
from ibvs_qp.symbolic.signals import Signals


@pytest.mark.parametrize("odd", [math.nan, math.inf, -math.inf])
def test_states_stay_where_one_of_them_would_not_be_finite(odd: float) -> None:
    signals = Signals()
    total, count = signals.state("total"), signals.state("count")
    signals.remember("total", total + signals.input("more"))
    signals.remember("count", count + 1.0)
    signals.output("shown", ca.sin(total))
    step = StepFunction(signals)
    for more in (2.0, odd, 3.0):
        step.inputs["more"][0] = more
        step.evaluate()
        step.advance()
    assert step.states["total"].item() == 5.0 and step.states["count"].item() == 2.0
    step.reset()
    assert step.states["total"].item() == step.states["count"].item() == 0.0
