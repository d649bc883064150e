"""The law without what brings the sensors to the present: for tests that set its inputs."""

from __future__ import annotations

from collections.abc import Sequence
from weakref import WeakKeyDictionary

import casadi as ca

from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.symbolic.function import StepFunction

_laws: WeakKeyDictionary[Setpoints, StepFunction] = WeakKeyDictionary()


def evaluate_law(setpoints: Setpoints, values: Sequence[ca.SX] = ()) -> None:
    """Evaluate the law at the point of the last tick, as a test has changed it.

    Args:
        setpoints: Their inputs are changed, their outputs are written.
        values: Further results with which the set-points were made.
    """
    if setpoints not in _laws:
        _laws[setpoints] = StepFunction(setpoints.model.signals, values)
    law = _laws[setpoints]
    law.point[:] = setpoints.step.point
    law.evaluate()
    for name, view in law.outputs.items():
        setpoints.step.outputs[name][:] = view
    for ours, new in zip(setpoints.step.extra, law.extra, strict=True):
        ours[:] = new
