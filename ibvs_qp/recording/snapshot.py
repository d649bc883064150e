"""Copies of a tick's inputs: the caller may use its arrays again before they are written."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

import numpy as np

from ibvs_qp.command import Command
from ibvs_qp.measurement import FeatureFrame, LineFeature, Measurement, Reference, RgbdFrame, SensorFrame

_FIELDS = {
    kind: attrgetter(*kind.__dataclass_fields__)
    for kind in (Command, FeatureFrame, LineFeature, Measurement, Reference, RgbdFrame, SensorFrame)
}
#: Longest tuple or list whose entries are copied; inputs have a few lines.
_MOST = 100


def copied(value: Any) -> Any:
    """The same value with arrays of its own; a dataclass of another type is returned as it is."""
    kind = type(value)
    if kind is np.ndarray:
        return value.copy()
    if kind in (tuple, list) and len(value) <= _MOST:
        return kind([copied(entry) for entry in value]) if value else value
    values = _FIELDS.get(kind)
    if values is None:
        return value
    twin = object.__new__(kind)
    twin.__dict__.update(zip(kind.__dataclass_fields__, map(copied, values(value)), strict=True))
    return twin
