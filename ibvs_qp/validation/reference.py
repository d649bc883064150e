"""References: accepted as a whole, otherwise the last accepted one stays in force."""

from __future__ import annotations

import numpy as np

from ibvs_qp.measurement import Reference
from ibvs_qp.validation.fields import REFERENCE
from ibvs_qp.validation.geometry import accepts_line_reference


def check_reference(reference: Reference, last: Reference) -> tuple[Reference, tuple[str, ...]]:
    """The new reference if all of it is accepted, otherwise the last one; and what was rejected."""
    if not isinstance(reference, Reference):
        return last, ("reference: not a Reference",)
    rejected = [f"reference.{field.rejection}" for field in REFERENCE.faults(reference)]
    if not isinstance(reference.contact, (bool, np.bool_)):
        rejected.append("reference.contact: neither True nor False")
    if not isinstance(reference.lines, tuple) or not all(map(accepts_line_reference, reference.lines)):
        rejected.append("reference.lines: not a tuple of finite lines with a known role")
    return (last, tuple(rejected)) if rejected else (reference, ())
