"""Reports of both laws: contact phase, reach, and commands of clipped thrusts."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ibvs_qp.command import ActiveLimit, Command, Outcome
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.frames import ordered_product
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.hover import hold_thrusts
from ibvs_qp.model.setpoints import Setpoints

#: A thrust this far outside its window counts as clipped [N].
CLIPPED = 1e-9
#: Largest magnitude of a number in a caller's contact, in any unit, and error of its normal's length.
CONTACT_BOUND, UNIT_TOLERANCE = 1e6, 1e-3
#: Place of the depth behind normal, known and distance.
DEPTH = ContactState._fields.index("depth") - 3
#: Types of its numbers.
PLAIN_TYPES = {float, int, bool, np.float64, np.bool_}
#: A push reduced by less than this is not reported [N].
REDUCED = 1e-3


def check_contact(contact: Any) -> tuple[ContactState | None, tuple[str, ...]]:
    """The contact of a caller if its numbers are valid; otherwise None, and the reasons of the rejection."""
    if contact is None:
        return None, ()
    if not issubclass(type(contact), ContactState):
        return None, ("contact: not a ContactState",)
    return (contact, ()) if _is_sound(contact) else (None, ("contact: not finite, or its normal has not length 1",))


def _is_sound(contact: ContactState) -> bool:
    """Whether all that enters the equations is finite; distance and depth are infinite while no wall is known."""
    normal, known, distance, *others = contact
    if type(normal) is not tuple or len(normal) != 3:
        return False
    if not PLAIN_TYPES.issuperset(map(type, (*normal, *contact[1:]))):
        return False
    if not known and others[DEPTH] == distance == math.inf:
        distance = others[DEPTH] = 0.0
    numbers = *normal, known, distance, *others
    if not (-CONTACT_BOUND <= min(numbers) and max(numbers) <= CONTACT_BOUND) or math.isnan(sum(numbers)):
        return False  # a NaN may hide from min and max, not from the sum; before the length: an integer may have none
    return abs(math.hypot(*normal) - 1.0) <= UNIT_TOLERANCE


def contact_mode(setpoints: Setpoints, reference: Reference) -> str:
    """Contact phase: "contact", "approach" or "free"."""
    if setpoints.in_contact:
        return "contact"
    return "approach" if reference.contact else "free"


def reach_margin(setpoints: Setpoints) -> float:
    """Further push possible at the present contact [N]; NaN while no wall is known, or none is possible."""
    push, reach = setpoints.contact_push, setpoints.reach
    if math.isnan(push) or setpoints.least_push > reach:
        return math.nan
    return reach - push if push > 0.0 else reach


def reach_note(setpoints: Setpoints, reference: Reference) -> tuple[str, ...]:
    """Reason why the push was reduced or is below the least possible one; empty if neither."""
    if not reference.contact:
        return ()
    commanded, least = reference.push_force, setpoints.least_push
    if commanded - setpoints.push_reference < REDUCED and least - commanded < REDUCED:
        return ()
    friction = setpoints.reach_friction  # of the travel commanded, or planned at this push
    how = f"against friction {friction:.2f} along the travel" if friction > 0.0 else "standing still"
    if least > setpoints.reach:
        return (f"reference.push_force: {commanded:.1f} N asked, the rotors cannot hold any push level, {how}",)
    low = least - commanded >= REDUCED
    other = least if low else setpoints.push_reference
    places = 3 if round(commanded, 1) == round(other, 1) else 1
    result = "asked, below the least push of the rotors," if low else "reduced to"
    end = "," if low else ", the rotors' reach"
    return (f"reference.push_force: {commanded:.{places}f} N {result} {other:.{places}f} N{end} {how}",)


def clip(setpoints: Setpoints, free: np.ndarray) -> np.ndarray:
    """Thrusts clipped to this tick's window [N], (n,)."""
    return np.minimum(np.maximum(free, setpoints.lower), setpoints.upper)


def clipped_command(
    setpoints: Setpoints,
    measurement: Measurement,
    reference: Reference,
    free: np.ndarray,
    outcome: Outcome,
    rejected: tuple[str, ...],
    allocate: Callable[[Setpoints, np.ndarray], np.ndarray] = clip,
) -> Command:
    """Command of thrusts that ignore the limits, brought into this tick's window; hover if they are not finite.

    Args:
        setpoints: Set-points of the tick; they store the command.
        measurement: Validated measurement of the tick.
        reference: Validated reference.
        free: Thrusts without limits [N], (n,).
        outcome: How they were found.
        rejected: Inputs refused.
        allocate: Thrusts within the window, from the set-points and finite thrusts without limits.
    """
    mode = contact_mode(setpoints, reference)
    if not np.isfinite(free).all():
        free, outcome, mode = hold_thrusts(setpoints.config, measurement), Outcome.HOLD, "hold"
    thrusts = allocate(setpoints, free)
    return _limited(setpoints, int(measurement.stamp_ns), free, thrusts, outcome, mode, rejected)


def hover_command(
    setpoints: Setpoints, stamp_ns: int, inertial: Measurement | None, rejected: tuple[str, ...]
) -> Command:
    """Command of a tick whose measurement was refused: hover by the last accepted inertial data, if any."""
    setpoints.pause()
    free = hold_thrusts(setpoints.config, inertial)
    return _limited(setpoints, stamp_ns, free, clip(setpoints, free), Outcome.HOLD, "hold", rejected)


def fixed_command(setpoints: Setpoints, stamp_ns: int, thrusts: np.ndarray, rejected: tuple[str, ...]) -> Command:
    """Command of given thrusts [N], (n,), within box and rate limit, without a law."""
    setpoints.pause()
    return _limited(setpoints, stamp_ns, thrusts, clip(setpoints, thrusts), Outcome.HOLD, "hold", rejected)


def _limited(
    setpoints: Setpoints,
    stamp_ns: int,
    free: np.ndarray,
    thrusts: np.ndarray,
    outcome: Outcome,
    mode: str,
    rejected: tuple[str, ...],
) -> Command:
    beyond = free - clip(setpoints, free)
    unallocated = ordered_product(setpoints.effectiveness, free - thrusts)
    setpoints.note(thrusts, max(map(abs, unallocated.tolist())))
    return Command(
        stamp_ns=stamp_ns,
        thrusts=thrusts,
        wrench=setpoints.effectiveness @ thrusts,
        outcome=outcome,
        mode=mode,
        rejected=rejected,
        active_limits=_clipped_rotors(setpoints, beyond.tolist()),
        unallocated_wrench=unallocated,
        reach_margin=math.nan if mode == "hold" else reach_margin(setpoints),
    )


def _clipped_rotors(setpoints: Setpoints, beyond: list[float]) -> tuple[ActiveLimit, ...]:
    """Rotors whose thrust was clipped; slack is the thrust beyond the limit [N]."""
    if not any(beyond):
        return ()
    names = setpoints.config.vehicle.geometry.names
    return tuple(
        ActiveLimit(
            name=f"thrust_{name}", side="upper" if over > 0.0 else "lower", price=math.nan, slack=abs(over), unit="N"
        )
        for name, over in zip(names, beyond, strict=True)
        if abs(over) > CLIPPED
    )
