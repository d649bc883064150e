"""One symbolic block of the tick on its own: write inputs, call, read outputs and states."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ibvs_qp.model.inputs import TOUCH
from ibvs_qp.model.signals import Signals
from ibvs_qp.model.tick_function import TickFunction

DEFAULTS = {"attitude": (1.0, 0.0, 0.0, 0.0), "normal": (1.0, 0.0, 0.0), "felt": 1.0, "moving": 1.0, "dt": 0.004}
TOUCH_DEFAULTS = {"known": 1.0, "stiffness": 1500.0, "stiffness_known": 1.0, "ramp": 1.0}


class Block:
    """A compiled block; `build(signals)` returns the expression read as `value` after each call."""

    def __init__(self, build: Callable[[Signals], Any]) -> None:
        signals = Signals()
        signals.output("value", build(signals))
        self.tick = TickFunction(signals)
        for name, value in DEFAULTS.items():
            if name in self.tick.inputs:
                self.tick.inputs[name][:] = value
        self.touch(**TOUCH_DEFAULTS)

    def touch(self, **values: float) -> None:
        """Set entries of the contact estimate by name."""
        for name, value in values.items():
            if "touch" in self.tick.inputs:
                self.tick.inputs["touch"][TOUCH.index(name)] = value

    def __call__(self, **inputs: Any) -> np.ndarray:
        """One tick with new inputs; those not named stay."""
        for name, value in inputs.items():
            self.tick.inputs[name][:] = value
        self.tick()
        return self.tick.outputs["value"].copy()
