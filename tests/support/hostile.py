"""Hostile inputs by mutation of recorded good ones: cheap, reproducible by a seed, nested to any depth."""

from __future__ import annotations

import dataclasses
import random
from typing import Any

import numpy as np
from hostile_values import INTEGERS, LEAPS, ODD_NUMBERS, ODD_VECTORS, REFUSED_NUMBERS, STAMPS, THINGS, Unit

#: Factors and offsets of believable wrong numbers.
_FACTORS, _OFFSETS = (-1.0, 0.0, 0.1, 0.5, 3.0, 5.0, 1e3), (0.0, 0.1, -3.0)
_TYPES = ("list", "tuple", "longdouble", "big-endian", "object", "strided", "masked", "subclass")


class Mutator:
    """Mutations.

    Args:
        choices: Source of all choices.
        lies: Whether believable wrong values are among them; without, everything wrong can be refused.
    """

    def __init__(self, choices: random.Random, lies: bool) -> None:
        self.random, self.lies = choices, lies
        self._things = [*THINGS, *REFUSED_NUMBERS, *((*ODD_NUMBERS, *ODD_VECTORS) if lies else ())]

    def thing(self) -> Any:
        """Any value."""
        return self.random.choice(self._things)

    def mutate(self, value: Any) -> Any:
        """A value that differs in one to three places."""
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            return self._instance(value)
        if isinstance(value, np.ndarray):
            return self._array(value)
        if hasattr(value, "_fields"):
            name = self.random.choice(value._fields)
            return value._replace(**{name: self.mutate(getattr(value, name))})
        if isinstance(value, tuple | list) and value and self.random.random() < 0.8:
            return self._sequence(value)
        if type(value) is int:
            return self._whole(value)
        if isinstance(value, float) and self.lies and self.random.random() < 0.3:
            return value * self.random.choice(_FACTORS)
        return self.thing()

    def _instance(self, value: Any) -> Any:
        names = [field.name for field in dataclasses.fields(value)]
        if self.random.random() < 0.03:
            return self.thing()
        chosen = self.random.sample(names, self.random.choice((1, 1, 1, 2, 3)))
        return dataclasses.replace(value, **{name: self.mutate(getattr(value, name)) for name in chosen})

    def _array(self, value: np.ndarray) -> Any:
        choice = self.random.random()
        if choice < 0.4 or value.size == 0:
            return self.thing()
        if choice < 0.7:
            changed = value.astype(self.random.choice((object, np.longdouble, float, float, float)))
            numbers = REFUSED_NUMBERS[:8] if changed.dtype == object else REFUSED_NUMBERS[:6]
            changed.flat[self.random.randrange(changed.size)] = self.random.choice(numbers)
            return changed
        if choice < 0.85 or not self.lies:
            return _other_type(value, self.random.choice(_TYPES))
        return value * self.random.choice(_FACTORS) + self.random.choice(_OFFSETS)

    def _sequence(self, value: Any) -> Any:
        entries = list(value)
        choice = self.random.random()
        if choice < 0.6:
            place = self.random.randrange(len(entries))
            entries[place] = self.mutate(entries[place])
        elif choice < 0.75:
            entries = entries * self.random.choice((0, 2, 7, 2000))
        elif choice < 0.9 or not self.lies:
            entries.insert(0, self.thing())
        else:
            entries.reverse()
        return entries if self.random.random() < 0.2 else tuple(entries)

    def _whole(self, value: int) -> Any:
        choice = self.random.random()
        if choice < 0.3:
            return self.random.choice(STAMPS)
        if choice < 0.6:
            return value + self.random.choice(LEAPS)
        if choice < 0.8:
            kind, bound = self.random.choice(list(INTEGERS.items()))
            return kind(value % bound)
        return self.thing()


def _other_type(value: np.ndarray, kind: str) -> Any:
    """The same numbers in another type; which of them are accepted is the check's business."""
    if kind in ("list", "tuple"):
        return value.tolist() if kind == "list" else tuple(value.tolist())
    if kind == "strided":
        return np.repeat(value, 2, axis=0)[::2]
    if kind in ("masked", "subclass"):
        return np.ma.array(value) if kind == "masked" else value.copy().view(Unit)
    return value.astype({"longdouble": np.longdouble, "big-endian": ">f8", "object": object}[kind])
