"""References: accepted as a whole, otherwise the last accepted one stays in force."""

from __future__ import annotations

from typing import Any

import numpy as np

from ibvs_qp.measurement import Reference
from ibvs_qp.validation.fields import REFERENCE, plain_instance
from ibvs_qp.validation.geometry import LINE_BOUND, read_line_reference, read_lines


class ReferenceGate:
    """Checks references for a controller; of the last accepted one it keeps plain numbers, no array of the caller.

    Args:
        line_slots: Lines that the program has room for; the surplus of a reference is named.
    """

    def __init__(self, line_slots: int) -> None:
        self._room = line_slots
        self.reset()

    def reset(self) -> None:
        """Without a reference the default one is in force."""
        self._last, _, _ = REFERENCE.read(Reference(), REFERENCE.fallbacks, [])
        self._contact, self._lines = False, ()

    @property
    def last(self) -> Reference:
        """The reference in force."""
        return Reference(contact=self._contact, lines=self._lines, **REFERENCE.values(self._last))

    def trust(self, reference: Reference) -> bool:
        """Accept a reference whose caller has made it of checked numbers, as `Pilot`.

        A second fence: bounds of the numbers, finite lines. Types of lines and their fields are not checked.

        Returns:
            False, and nothing accepted, where `check` might change a number.
        """
        entries, lines = REFERENCE.trusted(reference), reference.lines
        largest = sum([abs(line.rho) + abs(line.theta) for line in lines])  # not finite if one entry is not
        if entries is None or not largest <= LINE_BOUND or len(lines) > self._room:
            return False
        self._last, self._contact, self._lines = entries, reference.contact, lines
        return True

    def check(self, reference: Any) -> tuple[Reference, tuple[str, ...]]:
        """The new reference if all of it is accepted, otherwise the last one; and the rejections."""
        if not issubclass(type(reference), Reference):
            return self.last, ("reference: not a Reference",)
        reference, rejected = plain_instance(reference, Reference), []
        entries, changes, _ = REFERENCE.read(reference, self._last, rejected)
        contact, lines, surplus = reference.contact, reference.lines, ()
        if type(contact) not in (bool, np.bool_):
            rejected.append("contact: neither True nor False")
        if type(lines) in (tuple, list) and len(lines) > self._room:
            surplus = (f"reference.lines: {len(lines)} given, room for line_slots = {self._room}",)
            lines = lines[: self._room]
        accepted = read_lines(lines, read_line_reference, self._room, "lines", rejected)
        if rejected:
            return self.last, tuple([f"reference.{reason}" for reason in rejected])
        self._last, self._contact, self._lines = entries, bool(contact), accepted
        plain = not changes and accepted is reference.lines and contact is self._contact
        return reference if plain else self.last, surplus
