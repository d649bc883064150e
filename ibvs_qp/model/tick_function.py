"""The compiled tick: named arrays in, named arrays out, states carried from tick to tick."""

from __future__ import annotations

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from ibvs_qp.model.signals import Signals, places, stack
from ibvs_qp.qp.evaluator import BufferedFunction


class TickFunction:
    """One CasADi function of all signals, called through owned buffers.

    Attributes:
        inputs, states, outputs: Views by name; write inputs with ``[:] =``, outputs hold after a call.
        results: All outputs in one column; starts: where each of them begins in it.
        values: All inputs in one column, in the order in which they were asked for.
        extra: Arrays of the additional results, in their order.
    """

    def __init__(self, signals: Signals, extra: Sequence[ca.SX] = (), to_machine_code: bool = False) -> None:
        states = ca.densify(signals.next_states)
        results = [states, ca.sum1(states), stack(signals.outputs), *(ca.densify(result) for result in extra)]
        function = ca.Function("tick", [stack(signals.inputs), stack(signals.states)], ca.cse(results))
        self._call = BufferedFunction(function, to_machine_code)
        self.values, self._state = self._call.inputs
        self._next, total, self.results, *self.extra = self._call.outputs
        self.inputs = {name: self.values[place] for name, place in places(signals.inputs).items()}
        self.states = {name: self._state[place] for name, place in places(signals.states).items()}
        self.outputs = {name: self.results[place] for name, place in places(signals.outputs).items()}
        self.starts = {name: place.start for name, place in places(signals.outputs).items()}
        # What every tick needs, at hand: views of the memory are read and copied faster than arrays.
        self._evaluate, self._sum = self._call.evaluate, memoryview(total)  # type: ignore[arg-type]
        self._now, self._then = memoryview(self._state), memoryview(self._next)  # type: ignore[arg-type]
        self._start = np.concatenate([*signals.starts.values(), np.zeros(0)])
        self.reset()

    def reset(self) -> None:
        """States as at the start."""
        self._state[:] = self._start

    def __call__(self) -> None:
        """Evaluate; the states move on unless a result of theirs is not finite."""
        self._evaluate()
        if math.isfinite(self._sum[0]):
            self._now[:] = self._then
