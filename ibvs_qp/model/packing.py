"""One tick's measured numbers into the inputs of the compiled tick, all of them in one call."""

from __future__ import annotations

import struct

from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, Measurement, Reference
from ibvs_qp.model.inputs import ARRAYS, REFERENCE_INPUTS, SLOT_INPUTS, TOUCH
from ibvs_qp.model.pairing import LinePairing
from ibvs_qp.model.tick_function import TickFunction

#: Distance given to the equations while the wall is unknown [m].
FAR_AWAY = 1e3

_NOTHING = (0.0, 0.0, 0.0)


class TickInputs:
    """Packs what `ibvs_qp.model.inputs` asks for; writing input by input costs four times as much.

    Attributes:
        present: Slots with a line at this tick, and the roles of their lines.
    """

    def __init__(self, tick: TickFunction, slots: int) -> None:
        self._tick, self._slots, self._pairing = tick, slots, LinePairing(slots)
        count = sum(ARRAYS.values()) + 4 + len(TOUCH) + REFERENCE_INPUTS + slots + slots * SLOT_INPUTS
        self._pack = struct.Struct(f"{count}d").pack_into
        self._memory = memoryview(tick.values).cast("B")  # type: ignore[arg-type]
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        self._pairing.reset()
        self.present: list[tuple[int, str]] = []
        self._vertical = [0.0] * self._slots
        self._lines = [0.0] * (self._slots * SLOT_INPUTS)

    def write(self, measurement: Measurement, reference: Reference, contact: ContactState, dt: float) -> None:
        """Pack one checked measurement, its reference and the contact as estimated.

        Args:
            measurement: All of it but the thrust limits.
            reference: What is wanted.
            contact: Already brought up to date with the measurement.
            dt: Time since the last tick [s].
        """
        force, velocity = measurement.specific_force, measurement.velocity
        press, known = reference.contact, contact.known
        self._pair(measurement, reference, known)
        self._pack(
            self._memory,
            0,
            *measurement.attitude.tolist(),
            *measurement.angular_velocity.tolist(),
            *measurement.contact_wrench.tolist(),
            *(_NOTHING if force is None else force.tolist()),
            *(_NOTHING if velocity is None else velocity.tolist()),
            *contact.normal,
            dt,
            force is not None,
            velocity is not None,
            contact.contact_weight if press else 0.0,
            known,
            contact.distance if known else FAR_AWAY,
            contact.rate,
            contact.acceleration,
            contact.push,
            contact.push_noise,
            contact.across_noise,
            contact.in_contact,
            contact.ramp,
            contact.stiffness,
            contact.stiffness_known,
            reference.push_force,
            reference.standoff,
            *reference.velocity.tolist(),
            press,
            *reference.tilt.tolist(),
            *reference.travel.tolist(),
            *self._vertical,
            *self._lines,
        )

    def _pair(self, measurement: Measurement, reference: Reference, wall_known: bool) -> None:
        """Lines into their slots; what a slot remembers goes when it changes hands."""
        for slot in self._pairing.assign(reference.lines):
            for kind in ("integral", "last"):
                self._tick.states[f"line_{slot}_{kind}"][:] = 0.0
        packed = self._lines
        for slot, _ in self.present:
            packed[slot * SLOT_INPUTS] = 0.0
        self.present = present = []
        if not wall_known:
            return
        for slot, entry, vertical in self._pairing.pairs(measurement.lines, reference.lines):
            start = slot * SLOT_INPUTS
            packed[start : start + SLOT_INPUTS] = entry
            self._vertical[slot] = vertical
            present.append((slot, VERTICAL if vertical else HORIZONTAL))
