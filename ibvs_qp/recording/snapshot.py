"""Copies of a tick's inputs: the caller may use its arrays again before they are written."""

from __future__ import annotations

import typing
from typing import Any

import numpy as np

from ibvs_qp.command import Command
from ibvs_qp.measurement import FeatureFrame, LineFeature, Measurement, Reference, RgbdFrame, SensorFrame

_KINDS = (Command, FeatureFrame, LineFeature, Measurement, Reference, RgbdFrame, SensorFrame)
#: Fields of each that are, or may be, arrays, and those that hold instances of them; the others cannot be changed.
_ARRAYS, _NESTED = (
    {kind: tuple(name for name, hint in typing.get_type_hints(kind).items() if wanted(hint)) for kind in _KINDS}
    for wanted in (
        lambda hint: np.ndarray in (hint, *typing.get_args(hint)) or "tuple[float" in str(hint),
        lambda hint: any(str(name) in str(hint) for name in ("LineFeature", "FeatureFrame", "RgbdFrame")),
    )
)


def copied(value: Any) -> Any:
    """The same input with arrays of its own; what is no such input is returned as it is."""
    kind = type(value)
    if kind not in _ARRAYS:
        return value
    twin = object.__new__(kind)
    fields = twin.__dict__
    fields.update(value.__dict__)
    for name in _ARRAYS[kind]:
        entry = fields[name]
        if entry is not None:
            fields[name] = entry.copy() if type(entry) is np.ndarray else list(entry) if type(entry) is list else entry
    for name in _NESTED[kind]:
        entry = fields[name]
        if type(entry) in (tuple, list):
            fields[name] = tuple([copied(each) for each in entry])
        elif entry is not None:
            fields[name] = copied(entry)
    return twin
