"""Which line belongs to which reference: by role, then by order, each pair in a slot it keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.frames import align_line
from ibvs_qp.measurement import VERTICAL, LineFeature, LineReference
from ibvs_qp.vision.interaction import line_interaction_matrix

#: Lines farther than this from the optical axis are refused: the interaction matrix degenerates [normalised].
RHO_BOUND = 1.5


@dataclass(slots=True)
class LineTerm:
    """One paired line: where it is, its error at the tip and what is wanted of it."""

    role: str
    rho: float
    theta: float
    tip_x: float
    tip_y: float
    error: float
    error_rate: float
    angle_error: float
    angle_rate: float
    integral: float
    weight: float
    rho_error: float
    rho_rate: float
    plane: tuple[float, float, float, float]
    twist_map: np.ndarray

    @property
    def matrix(self) -> np.ndarray:
        """Interaction matrix in body axes, (2, 6): made when read, the program builds its own rows."""
        return line_interaction_matrix(self.rho, self.theta, self.plane) @ self.twist_map


class LinePairing:
    """Slots of the references; a pair of role and order keeps its slot, and its integral, while it is asked for."""

    def __init__(self, slots: int) -> None:
        self._count = slots
        self.reset()

    def reset(self) -> None:
        """Forget every pair."""
        self._roles: tuple[str, ...] = ()
        self._slots: dict[tuple[str, int], int] = {}
        self.keys: list[tuple[str, int]] = []
        self._places: list[tuple[int, float]] = []

    def assign(self, references: tuple[LineReference, ...]) -> list[int]:
        """Give every reference its slot.

        Returns:
            Slots that change hands: what they remember belongs to somebody else.
        """
        roles = tuple([reference.role for reference in references[: self._count]])
        if roles == self._roles:
            return []
        self._roles, order, self.keys = roles, {}, []
        for role in roles:
            order[role] = order.get(role, -1) + 1
            self.keys.append((role, order[role]))
        freed = [slot for key, slot in self._slots.items() if key not in self.keys]
        self._slots = {key: slot for key, slot in self._slots.items() if key in self.keys}
        for key in self.keys:
            if key not in self._slots:
                self._slots[key] = min(set(range(self._count)) - set(self._slots.values()))
        self._places = [(self._slots[key], float(key[0] == VERTICAL)) for key in self.keys]
        return freed

    def pairs(
        self, lines: tuple[LineFeature, ...], references: tuple[LineReference, ...]
    ) -> list[tuple[int, tuple[float, ...], float]]:
        """Entries of every slot that has a line: (slot, input, 1 for a vertical line)."""
        found = []
        for reference, (role, place), (slot, vertical) in zip(references, self.keys, self._places, strict=False):
            line = _nth(lines, role, place)
            if line is None or not -RHO_BOUND < line.rho < RHO_BOUND:
                continue
            wanted = reference.theta
            rho, theta = align_line(line.rho, line.theta, wanted)
            entry = (1.0, rho, theta, reference.rho, wanted, line.weight, line.covariance.item(0))
            found.append((slot, entry, vertical))
        return found


def _nth(lines: tuple[LineFeature, ...], role: str, place: int) -> LineFeature | None:
    for line in lines:
        if line.role == role:
            if place == 0:
                return line
            place -= 1
    return None
