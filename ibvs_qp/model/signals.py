"""Named inputs, states and outputs of one tick, gathered while the blocks write down their equations."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np


class Signals:
    """What a tick reads, remembers and yields, as symbols.

    A block asks for inputs, holds states from tick to tick and names outputs; asking twice gives the same symbol.
    Everything is then one `casadi.Function`: the tick costs one call, however many blocks there are.
    """

    def __init__(self) -> None:
        self.inputs: dict[str, ca.SX] = {}
        self.states: dict[str, ca.SX] = {}
        self.starts: dict[str, np.ndarray] = {}
        self.outputs: dict[str, ca.SX] = {}
        self._next: dict[str, ca.SX] = {}

    def input(self, name: str, size: int = 1) -> ca.SX:
        """Symbol of an input, (size,)."""
        return self.inputs.setdefault(name, ca.SX.sym(name, size))

    def state(self, name: str, size: int = 1, start: float | Sequence[float] = 0.0) -> ca.SX:
        """Symbol of what was remembered under a name; ``start`` is its value after a reset."""
        self.starts[name] = np.broadcast_to(np.asarray(start, float), (size,)).copy()
        return self.states.setdefault(name, ca.SX.sym(name, size))

    def remember(self, name: str, value: ca.SX) -> ca.SX:
        """Set what the next tick finds under a name; returns the value."""
        self._next[name] = value
        return value

    def next_state(self, name: str) -> ca.SX:
        """What `remember` set under a name."""
        return self._next[name]

    def output(self, name: str, value: ca.SX) -> ca.SX:
        """Name a result of the tick; returns the value."""
        self.outputs[name] = value
        return value

    @property
    def next_states(self) -> ca.SX:
        """States of the next tick, stacked in the order of `states`; what nobody sets stays."""
        return ca.vertcat(*(self._next.get(name, symbol) for name, symbol in self.states.items()))


def places(symbols: dict[str, ca.SX]) -> dict[str, slice]:
    """Where each named symbol lies in the stack of all of them."""
    layout, start = {}, 0
    for name, symbol in symbols.items():
        layout[name] = slice(start, start + symbol.numel())
        start += symbol.numel()
    return layout


def stack(symbols: dict[str, ca.SX]) -> ca.SX:
    """All symbols in one column."""
    return ca.densify(ca.vertcat(*symbols.values())) if symbols else ca.SX(0, 1)
