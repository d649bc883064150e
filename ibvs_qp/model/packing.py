"""Measurement, reference and contact into the inputs of the tick, in one block; stamps become ages."""

from __future__ import annotations

import struct
from itertools import chain

from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.wall_distance import FAR_AWAY
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, LineFeature, LineReference, Measurement, Reference
from ibvs_qp.model.inputs import TARGET
from ibvs_qp.model.tick import ARRAYS, GIVEN, LINE, SCALARS, TickFunction

_ZERO = (0.0, 0.0, 0.0)
#: Contact of a caller that has none.
_NOT_GIVEN = (0.0, 1.0) + (0.0,) * (sum(GIVEN.values()) - 2)
#: Plane before the first one: in front of the camera, for the equations.
_NO_PLANE = (0.0, 0.0, 1.0, -1.0)
#: Attributes that `StepInputs` keeps from tick to tick.
KEPT = ("_pairing", "_lines", "_paired", "_plane", "_plane_age")
#: Places in the entries of a line.
_PRESENT, _VERTICAL, _CHANGED = LINE.index("present"), LINE.index("vertical"), LINE.index("changed")


class LinePairing:
    """Indices of the references; a pair of role and order keeps its index, and its integral, while it is referenced.

    Args:
        lines: Lines that the program has room for.
    """

    def __init__(self, lines: int) -> None:
        self._count = lines
        self.reset()

    def reset(self) -> None:
        """Forget every pair."""
        self._roles: tuple[str, ...] = ()
        self._indices: dict[tuple[str, int], int] = {}
        self._keys: list[tuple[str, int]] = []

    def assign(self, references: tuple[LineReference, ...]) -> list[int]:
        """Give every reference its index.

        Returns:
            Indices that were freed: their states belong to another reference.
        """
        roles = tuple([reference.role for reference in references[: self._count]])
        if roles == self._roles:
            return []
        self._roles = roles
        self._keys = [(role, roles[:place].count(role)) for place, role in enumerate(roles)]
        freed = [index for key, index in self._indices.items() if key not in self._keys]
        self._indices = {key: index for key, index in self._indices.items() if key in self._keys}
        for key in self._keys:
            if key not in self._indices:
                self._indices[key] = min(set(range(self._count)) - set(self._indices.values()))
        return freed

    def pairs(
        self, lines: tuple[LineFeature, ...], references: tuple[LineReference, ...]
    ) -> list[tuple[int, LineFeature, LineReference]]:
        """Index, line and reference of every line with a reference, in the order of the references."""
        found = []
        for reference, (role, order) in zip(references, self._keys, strict=False):
            line = _nth(lines, role, order)
            if line is not None:
                found.append((self._indices[role, order], line, reference))
        return found


class StepInputs:
    """Packs the inputs that `ibvs_qp.model.tick` declares; entry by entry that costs four times as much."""

    STATE = ("_paired", "_plane", "_plane_age", "_lines")

    def __init__(self, step: TickFunction, lines: int) -> None:
        self._pairing = LinePairing(lines)
        self._lines = [[0.0] * len(LINE) for _ in range(lines)]
        self._present = [step.inputs[f"line_{index}.present"] for index in range(lines)]
        count = sum(ARRAYS.values()) + len(SCALARS) + sum(GIVEN.values()) + len(TARGET) + lines * len(LINE)
        self._memory = memoryview(step.values[:count])  # type: ignore[arg-type]
        self._pack = struct.Struct(f"{count}d").pack_into  # half as long as an assignment to an array
        self.reset()

    def reset(self) -> None:
        """Forget all pairs of lines and references."""
        self._pairing.reset()
        self._paired: list[int] = []
        self._plane, self._plane_age = _NO_PLANE, 0.0
        for line in self._lines:
            line[:] = [0.0] * len(LINE)

    @property
    def present(self) -> list[tuple[int, str]]:
        """Indices of the lines that the last evaluation took, in the order of their references, and their roles."""
        taken = [index for index in self._paired if self._present[index][0]]
        return [(index, VERTICAL if self._lines[index][_VERTICAL] else HORIZONTAL) for index in taken]

    def write(
        self, measurement: Measurement, reference: Reference, contact: ContactState | None, elapsed: float
    ) -> None:
        """Pack a validated measurement (not its thrust limits) and reference.

        Args:
            measurement: The measurement.
            reference: The reference.
            contact: Contact of a caller, None to estimate it.
            elapsed: Time since the last tick [s].
        """
        force, velocity, bias = measurement.specific_force, measurement.velocity, measurement.acceleration_bias
        stamp, velocity_ns = measurement.stamp_ns, measurement.velocity_stamp_ns
        if measurement.plane is not None:
            self._plane, self._plane_age = measurement.plane, 1e-9 * (stamp - measurement.plane_stamp_ns)
        self._pair(measurement, reference)
        self._pack(
            self._memory,
            0,
            *measurement.attitude.tolist(),
            *measurement.angular_velocity.tolist(),
            *measurement.contact_wrench.tolist(),
            *(_ZERO if force is None else force.tolist()),
            *(_ZERO if velocity is None else velocity.tolist()),
            *(_ZERO if bias is None else bias.tolist()),
            *self._plane,
            # SCALARS
            elapsed,
            force is not None,
            velocity is not None,
            0.0 if velocity is None or velocity_ns is None else 1e-9 * (stamp - velocity_ns),
            1e-9 * (stamp - measurement.wrench_stamp_ns),
            measurement.plane is not None,
            self._plane_age,
            # GIVEN
            *(_NOT_GIVEN if contact is None else _given(contact)),
            # TARGET
            reference.push_force,
            reference.standoff,
            *reference.velocity.tolist(),
            reference.contact,
            *reference.tilt.tolist(),
            *reference.travel.tolist(),
            *reference.trim.tolist(),
            # LINE, for every line
            *chain.from_iterable(self._lines),
        )

    def _pair(self, measurement: Measurement, reference: Reference) -> None:
        """Assign lines to indices; an index that changes its reference loses integral and rate."""
        freed, stamp = self._pairing.assign(reference.lines), measurement.stamp_ns
        for index, line in enumerate(self._lines):
            line[_PRESENT], line[_CHANGED] = 0.0, index in freed  # the other entries stay: finite equations
        self._paired = []
        for index, line, target in self._pairing.pairs(measurement.lines, reference.lines):
            vertical, age = line.role == VERTICAL, 1e-9 * (stamp - line.stamp_ns) if line.stamp_ns else 0.0
            measured = (1.0, vertical, line.rho, line.theta, target.rho, target.theta)
            self._lines[index][:_CHANGED] = (*measured, line.weight, line.covariance.item(0), age)
            self._paired.append(index)


def _given(contact: ContactState) -> tuple[float, ...]:
    """Entries of a caller's contact."""
    return (
        1.0,
        *contact.normal,
        contact.contact_weight,
        contact.known,
        contact.distance if contact.known else FAR_AWAY,
        contact.rate,
        contact.acceleration,
        contact.rate_noise,
        contact.acceleration_noise,
        contact.bias,
        contact.push,
        contact.push_noise,
        contact.across_noise,
        contact.in_contact,
        contact.ramp,
        contact.stiffness,
        contact.stiffness_known,
    )


def _nth(lines: tuple[LineFeature, ...], role: str, order: int) -> LineFeature | None:
    for line in lines:
        if line.role == role:
            if order == 0:
                return line
            order -= 1
    return None
