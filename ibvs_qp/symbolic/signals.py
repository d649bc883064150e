"""Named inputs, states and outputs of the step function, as symbols."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import casadi as ca
import numpy as np

from ibvs_qp.config.errors import ConfigError


class Signals:
    """Registry of the symbols of one step.

    Every equation reads inputs and states and writes next states and outputs under a name. The same name returns the
    same symbol. All of them together become one `casadi.Function`, so a step costs one call.
    """

    def __init__(self) -> None:
        self.inputs: dict[str, ca.SX] = {}
        self.states: dict[str, ca.SX] = {}
        self.starts: dict[str, np.ndarray] = {}
        self.outputs: dict[str, ca.SX] = {}
        self._next: dict[str, ca.SX] = {}

    def input(self, name: str, size: int = 1) -> ca.SX:
        """Symbol of an input, (size,); ConfigError when it exists with another size."""
        symbol = self.inputs.setdefault(name, ca.SX.sym(name, size))
        if symbol.numel() != size:
            raise ConfigError(f"input {name!r} has {symbol.numel()} entries, not {size}")
        return symbol

    def state(self, name: str, size: int = 1, start: float | Sequence[float] = 0.0) -> ca.SX:
        """Symbol of a state, (size,); ``start`` is its value after a reset."""
        self.starts[name] = np.broadcast_to(np.asarray(start, float), (size,)).copy()
        return self.states.setdefault(name, ca.SX.sym(name, size))

    def remember(self, name: str, value: ca.SX) -> ca.SX:
        """Set the value of a state at the next step; returns it."""
        self._next[name] = value
        return value

    def next_state(self, name: str) -> ca.SX:
        """Value that `remember` set for the next step."""
        return self._next[name]

    def output(self, name: str, value: ca.SX) -> ca.SX:
        """Name a result of the step; returns it."""
        self.outputs[name] = value
        return value

    def copy(self) -> Signals:
        """The same symbols; names added to the copy stay in it."""
        other = copy.copy(self)
        for name, table in vars(self).items():
            setattr(other, name, dict(table))
        return other

    @property
    def next_states(self) -> ca.SX:
        """States at the next step, stacked in the order of `states`; a state without an update stays constant."""
        return ca.vertcat(*(self._next.get(name, symbol) for name, symbol in self.states.items()))


class GatedSignals(Signals):
    """View of a registry whose states begin anew, or stay as they are, on a condition.

    Args:
        signals: The registry.
        restart: The states of this tick are those of a reset.
        hold: The next states are the present ones.
    """

    def __init__(self, signals: Signals, restart: ca.SX, hold: ca.SX) -> None:
        super().__init__()
        self._signals, self._restart, self._hold = signals, restart, hold
        self.inputs, self.outputs = signals.inputs, signals.outputs

    def state(self, name: str, size: int = 1, start: float | Sequence[float] = 0.0) -> ca.SX:
        """Symbol of a state, or its start value."""
        symbol = self._signals.state(name, size, start)
        return ca.if_else(self._restart, ca.DM(self._signals.starts[name]), symbol)

    def remember(self, name: str, value: ca.SX) -> ca.SX:
        """Set the value of a state at the next step, unless it stays; returns it."""
        self._signals.remember(name, ca.if_else(self._hold, self._signals.states[name], value))
        return value


def places(symbols: dict[str, ca.SX]) -> dict[str, slice]:
    """Place of each named symbol in the stack of all of them."""
    layout, start = {}, 0
    for name, symbol in symbols.items():
        layout[name] = slice(start, start + symbol.numel())
        start += symbol.numel()
    return layout


def stack(symbols: dict[str, ca.SX]) -> ca.SX:
    """All symbols in one column."""
    return ca.densify(ca.vertcat(*symbols.values())) if symbols else ca.SX(0, 1)
