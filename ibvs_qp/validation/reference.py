"""What may be asked of a controller: a reference is taken as a whole, or the last sound one stays in force."""

from __future__ import annotations

from typing import Any

import numpy as np

from ibvs_qp.measurement import LineReference, Reference
from ibvs_qp.validation.fields import (
    PUSH_BOUND,
    STANDOFF_RANGE,
    TILT_BOUND,
    VELOCITY_BOUND,
    good_place,
    good_role,
    is_number,
    sound_vector,
    surely_good_reference,
)


def check_reference(reference: Reference, last: Reference) -> tuple[Reference, tuple[str, ...]]:
    """The reference if it is sound, else the last sound one and the names of what was refused."""
    if surely_good_reference(reference):
        return reference, ()
    if not isinstance(reference, Reference):
        return last, ("reference: not a Reference",)
    rejected = []
    if not is_number(reference.push_force, 0.0, PUSH_BOUND):
        rejected.append("reference.push_force: not within [0, 1000] N")
    if not is_number(reference.standoff, *STANDOFF_RANGE):
        rejected.append("reference.standoff: not within [-1, 10] m")
    if not sound_vector(reference.velocity, 2, VELOCITY_BOUND):
        rejected.append("reference.velocity: not 2 finite values")
    if not sound_vector(reference.travel, 2, VELOCITY_BOUND):
        rejected.append("reference.travel: not 2 finite values")
    if not sound_vector(reference.tilt, 2, TILT_BOUND):
        rejected.append(f"reference.tilt: not 2 finite values within {TILT_BOUND} rad")
    if not isinstance(reference.contact, (bool, np.bool_)):
        rejected.append("reference.contact: neither True nor False")
    if not isinstance(reference.lines, tuple) or not all(_good_reference_line(line) for line in reference.lines):
        rejected.append("reference.lines: not a tuple of finite lines with a known role")
    return (last, tuple(rejected)) if rejected else (reference, ())


def _good_reference_line(line: Any) -> bool:
    return isinstance(line, LineReference) and good_role(line.role) and good_place(line.rho, line.theta)
