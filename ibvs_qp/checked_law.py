"""A control law behind the checks of its inputs: common to the program's and the analytic controller."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ibvs_qp.command import Command
from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.turned_camera import TurnedCamera
from ibvs_qp.flight_state import FlightState, Rebuilt, put_state, take_state
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.reporting import check_contact, hover_command
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.validation.failure import raised
from ibvs_qp.validation.measurement import MeasurementGate, ReferenceGate, answered_stamp

#: Without a measured velocity the integral alone moves the vehicle: a slide falls short.
NO_VELOCITY = "velocity: missing, tracking of the reference's velocity is degraded"


class Inputs(NamedTuple):
    """Checked inputs of one tick, in the time of the measurements' clock."""

    stamp_ns: int  # of the measurement as it came
    measurement: Measurement | None  # None if it was refused
    reference: Reference
    contact: ContactState | None
    rejected: tuple[str, ...]  # refused inputs, with the reason


class CheckedLaw(Rebuilt):
    """Checks its inputs and never raises; a subclass is the law.

    Attributes:
        config: Everything it needs.
        setpoints: Targets of the last step.
        gate, references: Checks of the measurements and of the references.
    """

    setpoints: Setpoints

    def __init__(self, config: ControllerConfig) -> None:
        self.config = self.initial_config = config
        self.gate = MeasurementGate(config.vehicle.geometry.count, config.line_slots)
        self.references = ReferenceGate(config.line_slots)
        self._camera = TurnedCamera(config.vehicle.camera_turn_deg)

    def reset(self) -> None:
        """Restore the state after construction, bit-identical."""
        self.setpoints.reset()
        self.gate.reset()
        self.references.reset()

    def state(self) -> FlightState:
        """Everything that changes from step to step; `restore` of this or an equal controller continues from it.

        The solver sets up anew after it, here as in every copy: later thrusts may differ in their last bits from those
        without a snapshot, but not from copy to copy. `Parameter` values of further tasks stay the caller's.
        """
        return take_state(self, self.initial_config)

    def restore(self, state: FlightState) -> None:
        """Continue from a state, bit-identical to the controller that it is of.

        Raises:
            ConfigError: When it is of another class, configuration, tasks or limits.
        """
        put_state(self, self.initial_config, state)

    @np.errstate(all="ignore")  # a host may have numpy raise at every underflow
    def step(self, measurement: Measurement, reference: Reference, contact: ContactState | None = None) -> Command:
        """Thrusts for one tick; never raises, never leaves the limits.

        Inputs are copied, so the caller may reuse its arrays; the command's arrays are the caller's.

        Args:
            measurement: State of the vehicle; fields that fail the checks are named in ``Command.rejected``.
            reference: Targets.
            contact: Wall and contact if the caller estimates them (`Pilot` does); None estimates them here from the
                measurement.

        Returns:
            The command with its explanation.
        """
        return self.answer(measurement, reference, contact)

    def answer(self, measurement: Any, reference: Any, contact: Any, trusted: bool = False) -> Command:
        """Thrusts for one tick, as `step`, for a caller that has set numpy's error state, as `Pilot` has.

        The numbers of ``trusted`` inputs were checked by the caller: one test of their bounds replaces the checks.
        """
        try:
            inputs = self.check(measurement, reference, contact, trusted)
            command = self.respond(inputs)
            return command if inputs.measurement is None else self.gate.clock.answered(command)
        except Exception as error:  # in flight nothing may raise; the reason is reported instead
            stamp = answered_stamp(measurement)
            return hover_command(self.setpoints, stamp, self.gate.inertial, (raised("step", error),))

    def check(self, measurement: Any, reference: Any, contact: Any, trusted: bool = False) -> Inputs:
        """First half of `step`."""
        checked, rejected = measurement, ()
        if not (trusted and self.gate.trust(measurement)):
            checked, rejected = self.gate.check(measurement)
        if checked is not None and not self._camera.straight:
            unseen: list[str] = []
            checked = self._camera.measurement(checked, unseen)
            rejected += tuple(unseen)
        refused = ()
        if not (trusted and self.references.trust(reference)):
            reference, refused = self.references.check(reference)
        contact, unusable = check_contact(contact)
        if checked is not None and checked.velocity is None and reference.velocity.any():
            unusable += (NO_VELOCITY,)
        return Inputs(answered_stamp(measurement), checked, reference, contact, rejected + refused + unusable)

    def respond(self, inputs: Inputs) -> Command:
        """Second half of `step`: hover by the last inertial data without a measurement, otherwise the law."""
        stamp_ns, measurement, reference, contact, rejected = inputs
        if measurement is None:
            return hover_command(self.setpoints, stamp_ns, self.gate.inertial, rejected)
        self.setpoints.update(measurement, reference, contact)
        return self._command(measurement, reference, rejected)

    def adjust(self, values: Mapping[str, Any]) -> None:
        """Change gains, weights and limits from the next step on; states and sparsity stay.

        Args:
            values: By the names of a preset, as in ``{"weights.push": 0.2, "limits.tilt_deg": 2.0}``. A weight of 0
                switches rows off, ``"limits.yaw_barrier": False`` a limit. A `Parameter` of an own task has its name.

        Raises:
            ConfigError: Naming a name that cannot change, or a value out of range; nothing is changed then.
        """
        self.setpoints.adjust(values)
        self.config = self.setpoints.config

    @abstractmethod
    def _command(self, measurement: Measurement, reference: Reference, rejected: tuple[str, ...]) -> Command:
        """Command of the law at the present set-points."""
