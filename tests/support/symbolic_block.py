"""One symbolic block of the tick on its own: write inputs, call, read outputs and states."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ibvs_qp.symbolic.function import StepFunction
from ibvs_qp.symbolic.signals import Signals

DEFAULTS = {"attitude": (1.0, 0.0, 0.0, 0.0), "normal": (1.0, 0.0, 0.0), "dt": 0.004}
DEFAULTS |= {"specific_force_known": 1.0, "velocity_known": 1.0}
CONTACT_DEFAULTS = {"known": 1.0, "stiffness": 1500.0, "stiffness_known": 1.0, "ramp": 1.0}


class Block:
    """A compiled block; `build(signals)` returns the expression read as `value` after each call."""

    def __init__(self, build: Callable[[Signals], Any]) -> None:
        signals = Signals()
        signals.output("value", build(signals))
        self.step = StepFunction(signals)
        for name, value in DEFAULTS.items():
            if name in self.step.inputs:
                self.step.inputs[name][:] = value
        self.contact(**CONTACT_DEFAULTS)

    def contact(self, **values: float) -> None:
        """Set entries of the contact estimate by name."""
        for name, value in values.items():
            if f"contact.{name}" in self.step.inputs:
                self.step.inputs[f"contact.{name}"][:] = value

    def __call__(self, **inputs: Any) -> np.ndarray:
        """One tick with new inputs; those not named stay."""
        for name, value in inputs.items():
            self.step.inputs[name][:] = value
        self.step.evaluate()
        self.step.advance()
        return self.step.outputs["value"].copy()
