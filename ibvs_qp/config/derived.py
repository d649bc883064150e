"""Settings that follow from others unless they are stated."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

T = TypeVar("T")


class Derived(float):
    """A number that follows from the vehicle: computed anew for another vehicle, and left out of TOML files."""


def derive(section: T, values: dict[str, float]) -> T:
    """A settings section with derived values where none is stated.

    Args:
        section: A settings dataclass; a field that is None or `Derived` is not stated.
        values: Derived values by field.
    """
    own: dict[str, Any] = {name: getattr(section, name) for name in values}
    open_ones = {name: Derived(values[name]) for name, value in own.items() if value is None or type(value) is Derived}
    return dataclasses.replace(section, **open_ones)  # type: ignore[type-var]


def stated(section: T) -> T:
    """The same section with its derived values as if they were stated."""
    values = {field.name: getattr(section, field.name) for field in dataclasses.fields(section)}  # type: ignore[arg-type]
    fixed: dict[str, Any] = {name: float(value) for name, value in values.items() if type(value) is Derived}
    return dataclasses.replace(section, **fixed)  # type: ignore[type-var]
