"""What both laws report alike: contact phase, reach, and thrusts that were clipped."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.command import ActiveLimit, Command, Outcome
from ibvs_qp.measurement import Reference
from ibvs_qp.model.setpoints import Setpoints

#: A thrust this far outside its window counts as clipped [N].
CLIPPED = 1e-9
#: A push reduced by less than this is not worth a word [N].
REDUCED = 1e-3


def contact_mode(terms: Setpoints, reference: Reference) -> str:
    """Contact phase: "contact", "approach" or "free"."""
    if terms.contact.in_contact:
        return "contact"
    return "approach" if reference.contact else "free"


def reach_margin(terms: Setpoints) -> float:
    """Further push possible at the present contact [N]; NaN while no wall is known, or no push can be held."""
    contact, reach = terms.contact, terms.reach
    if not contact.known or terms.least_push > reach:
        return math.nan
    return reach - contact.push if contact.push > 0.0 else reach


def reach_note(terms: Setpoints, reference: Reference) -> tuple[str, ...]:
    """Says that the push was reduced, or is less than can be held, and why; empty if neither."""
    if not reference.contact:
        return ()
    asked, least = reference.push_force, terms.least_push
    if asked - terms.push_reference < REDUCED and least - asked < REDUCED:
        return ()
    friction = terms.reach_friction  # of the travel commanded, or planned at this push
    how = f"against friction {friction:.2f} along the travel" if friction > 0.0 else "standing still"
    if least > terms.reach:
        return (f"reference.push_force: {asked:.1f} N asked, the rotors cannot hold any push level, {how}",)
    if least - asked >= REDUCED:
        return (
            f"reference.push_force: {asked:.1f} N asked, below what the rotors can hold: least {least:.1f} N, {how}",
        )
    return (f"reference.push_force: {asked:.1f} N reduced to {terms.push_reference:.1f} N, the rotors' reach {how}",)


def clipped_command(
    terms: Setpoints, stamp_ns: int, free: np.ndarray, outcome: Outcome, mode: str, rejected: tuple[str, ...]
) -> Command:
    """Command of free thrusts clipped to this tick's window; names the rotors that were clipped.

    Args:
        terms: Set-points of the tick; take note of what is commanded.
        stamp_ns: Time of the measurement answered.
        free: Thrusts without limits [N], (n,).
        outcome: How they were found.
        mode: Contact phase.
        rejected: Inputs refused.
    """
    thrusts = np.minimum(np.maximum(free, terms.lower), terms.upper)
    beyond = free - thrusts
    unallocated = terms.effectiveness.dot(beyond)
    terms.note(thrusts, max(map(abs, unallocated.tolist())))
    return Command(
        stamp_ns=stamp_ns,
        thrusts=thrusts,
        wrench=terms.effectiveness @ thrusts,
        outcome=outcome,
        mode=mode,
        rejected=rejected,
        active_limits=_clipped_rotors(terms, beyond.tolist()),
        unallocated_wrench=unallocated,
        reach_margin=math.nan if mode == "hold" else reach_margin(terms),
    )


def _clipped_rotors(terms: Setpoints, beyond: list[float]) -> tuple[ActiveLimit, ...]:
    """Rotors whose thrust was clipped, with what was taken away [N]."""
    if not any(beyond):
        return ()
    names = terms.config.vehicle.geometry.names
    return tuple(
        ActiveLimit(
            name=f"thrust_{name}",
            side="upper" if over > 0.0 else "lower",
            price=math.nan,
            slack=abs(over),
            unit="N",
        )
        for name, over in zip(names, beyond, strict=True)
        if abs(over) > CLIPPED
    )
