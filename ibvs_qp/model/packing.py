"""Measurement, reference and contact into the inputs of the step function, in one block."""

from __future__ import annotations

from itertools import chain

from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, Measurement, Reference
from ibvs_qp.model.inputs import ARRAYS, CONTACT, LINE, SCALARS, TARGET
from ibvs_qp.model.pairing import LinePairing
from ibvs_qp.symbolic.step_function import StepFunction

#: Distance while the wall is unknown [m]; finite, for the equations.
FAR_AWAY = 1e3

_ZERO = (0.0, 0.0, 0.0)


class StepInputs:
    """Packs the inputs that `ibvs_qp.model.inputs` declares; entry by entry that costs four times as much.

    Attributes:
        present: Indices of the lines present at this step, and their roles.
    """

    def __init__(self, step: StepFunction, lines: int) -> None:
        self._step, self._pairing = step, LinePairing(lines)
        self._lines = [[0.0] * len(LINE) for _ in range(lines)]
        count = sum(ARRAYS.values()) + len(SCALARS) + len(CONTACT) + len(TARGET) + lines * len(LINE)
        self._block = step.values[:count]
        self.reset()

    def reset(self) -> None:
        """Forget all pairs of lines and references."""
        self._pairing.reset()
        self.present: list[tuple[int, str]] = []
        for line in self._lines:
            line[:] = [0.0] * len(LINE)

    def write(self, measurement: Measurement, reference: Reference, contact: ContactState, dt: float) -> None:
        """Pack a validated measurement (not its thrust limits), reference, contact and time since the last step [s]."""
        force, velocity, bias = measurement.specific_force, measurement.velocity, measurement.acceleration_bias
        press, known = reference.contact, contact.known
        self._pair(measurement, reference, known)
        self._block[:] = (
            *measurement.attitude.tolist(),
            *measurement.angular_velocity.tolist(),
            *measurement.contact_wrench.tolist(),
            *(_ZERO if force is None else force.tolist()),
            *(_ZERO if velocity is None else velocity.tolist()),
            *(_ZERO if bias is None else bias.tolist()),
            *contact.normal,
            # SCALARS
            dt,
            force is not None,
            velocity is not None,
            contact.contact_weight if press else 0.0,
            # CONTACT
            known,
            contact.distance if known else FAR_AWAY,
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
            # TARGET
            reference.push_force,
            reference.standoff,
            *reference.velocity.tolist(),
            press,
            *reference.tilt.tolist(),
            *reference.travel.tolist(),
            *reference.trim.tolist(),
            # LINE, for every line
            *chain.from_iterable(self._lines),
        )

    def _pair(self, measurement: Measurement, reference: Reference, wall_known: bool) -> None:
        """Assign lines to indices; an index that changes its reference loses integral and rate."""
        for index in self._pairing.assign(reference.lines):
            for state in ("integral", "last"):
                self._step.states[f"line_{index}_{state}"][:] = 0.0
        for line in self._lines:
            line[0] = 0.0  # absent; the other entries stay, so that its equations stay finite
        self.present = []
        if wall_known:
            for index, entries in self._pairing.pairs(measurement.lines, reference.lines):
                self._lines[index][:] = entries
                self.present.append((index, VERTICAL if entries[1] else HORIZONTAL))
