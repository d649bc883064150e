"""Assured: a controller under supervision, for loops without a `Pilot`."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from ibvs_qp.checked_law import CheckedLaw, Inputs
from ibvs_qp.command import Command
from ibvs_qp.config import LONGEST_TICK, SafetySettings
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.flight_state import FlightState, Rebuilt, put_state, take_state
from ibvs_qp.frames import dot, down_in_body
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.reporting import hover_command
from ibvs_qp.supervision.faults import Fault
from ibvs_qp.supervision.monitors import Tick
from ibvs_qp.supervision.supervision import Supervision
from ibvs_qp.validation.failure import raised
from ibvs_qp.validation.measurement import answered_stamp

#: Fields without which a measurement has no attitude, and no inertial sample.
_ATTITUDE = {"attitude", "angular_velocity"}
_INERTIAL = _ATTITUDE | {"specific_force"}


class Assured(Rebuilt):
    """Monitors and supervisor around a controller, with the same `step`; one line to add to a loop.

    ``controller = Assured(HybridController(config))``

    Ages follow from the stamps of the measurement: attitude and inertial sensors, wrench, plane once one was given,
    and lines once one with a stamp was given.

    Attributes:
        controller: The controller.
        supervision: Monitors, state machine and reactions.

    Args:
        controller: The controller to supervise.
        settings: Bounds of the monitors and motions of the states.
    """

    def __init__(self, controller: CheckedLaw, settings: SafetySettings | None = None) -> None:
        self.controller, self.supervision = controller, Supervision(controller.config, settings)
        self.reset()

    def reset(self) -> None:
        """As after construction."""
        self.controller.reset()
        self.supervision.reset()
        self._attitude_ns = self._plane_ns = self._lines_ns = self._time_ns = -1
        self._dt = self._descended_m = 0.0

    def state(self) -> FlightState:
        """Everything that changes from step to step, as `CheckedLaw.state`."""
        return take_state(self, self.controller.initial_config)

    def restore(self, state: FlightState) -> None:
        """Continue from a state, as `CheckedLaw.restore`."""
        put_state(self, self.controller.initial_config, state)

    @np.errstate(all="ignore")  # a host may have numpy raise at every underflow
    def step(self, measurement: Measurement, reference: Reference, contact: ContactState | None = None) -> Command:
        """Thrusts for one tick, as `HybridController.step`; ``Command.safety`` is the state of the supervisor."""
        controller, supervision, command, shown = self.controller, self.supervision, None, None
        try:
            inputs = controller.check(measurement, reference, contact)
            inputs = inputs._replace(reference=supervision.reference(inputs.reference))
            checked = inputs.measurement
            if checked is None:
                command = self._command(inputs)
                shown = supervision.explained(command)
                supervision.miss()
                return shown
            tick_s, now = controller.config.tick_s, checked.stamp_ns
            self._dt, self._time_ns = (now - self._time_ns) * 1e-9 if self._time_ns >= 0 else tick_s, now
            inputs = self._with_rotors(inputs, checked)
            command = self._command(inputs)
            shown = supervision.explained(command)
            if found := self._check_axes(checked):
                shown = dataclasses.replace(shown, rejected=(*shown.rejected, *found))
            supervision.watch(self._tick(checked, command, inputs.reference), controller.setpoints)
            return controller.gate.clock.answered(shown)
        except Exception as error:  # in flight nothing may raise; thrusts that were found are not replaced
            stamp = answered_stamp(measurement)
            if command is None:
                command = hover_command(controller.setpoints, stamp, controller.gate.inertial, ())
                supervision.miss()
            if shown is None:  # a second change in a tick would break the rate limit
                shown = supervision.explained(command)
            rejected = (*shown.rejected, raised("assured", error))
            return dataclasses.replace(shown, stamp_ns=stamp, rejected=rejected)

    def _with_rotors(self, inputs: Inputs, checked: Measurement) -> Inputs:
        """Inputs with the limits of rotors that do not follow, and with the attitude at which those left carry it."""
        supervision, setpoints, rotors = self.supervision, self.controller.setpoints, self.supervision.rotor_loss
        if not supervision.settings.supervise:
            return inputs
        low, high, changes = checked.thrust_min, checked.thrust_max, dict[str, Any]()
        reported = setpoints.floor if low is None else low, setpoints.ceiling if high is None else high
        limits = supervision.limits(reported)
        if limits is not None and limits is not reported:
            changes = {"thrust_min": limits[0], "thrust_max": limits[1]}
        if changes or low is not None or high is not None:
            rotors.update(limits)
        contact, velocity = setpoints.contact, checked.velocity
        sample, turned = (checked.contact_wrench, checked.wrench_stamp_ns), rotors.turns(contact.normal[0])
        wrench, stamp_ns = supervision.contact_wrench(sample, checked.stamp_ns, turned, setpoints)
        if wrench is not checked.contact_wrench:
            changes |= {"contact_wrench": wrench, "wrench_stamp_ns": stamp_ns}
        along = 0.0 if velocity is None else float(setpoints.right @ velocity)
        if attitude := rotors.target(contact, checked.attitude.tolist(), along, min(self._dt, LONGEST_TICK)):
            inputs = inputs._replace(reference=dataclasses.replace(inputs.reference, **attitude))
        return inputs._replace(measurement=dataclasses.replace(checked, **changes)) if changes else inputs

    def _command(self, inputs: Inputs) -> Command:
        """Command of the law, or of the supervisor where it replaces the law."""
        law, checked = self.controller, inputs.measurement
        stamp_ns = inputs.stamp_ns if checked is None else checked.stamp_ns
        return self.supervision.command(lambda: law.respond(inputs), law.setpoints, stamp_ns, inputs.rejected)[0]

    def _check_axes(self, checked: Measurement) -> tuple[str, ...]:
        """Self-check with those sensors that the tick has; the contact wrench is that of the tool on the vehicle."""
        missing, inertial, tool = self.controller.gate.replaced, None, None
        if checked.specific_force is not None and _INERTIAL.isdisjoint(missing):
            inertial = (
                checked.attitude.tolist(),
                checked.angular_velocity.tolist(),
                checked.specific_force.tolist(),
            )
        if "contact_wrench" not in missing:
            tool = (-checked.contact_wrench[:3]).tolist()
        return self.supervision.check_axes(inertial, tool, self.controller.setpoints.contact, self._dt)

    def _tick(self, checked: Measurement, command: Command, reference: Reference) -> Tick:
        """Inputs of the monitors, in monotonic time."""
        missing, setpoints, supervision = self.controller.gate.replaced, self.controller.setpoints, self.supervision
        now = checked.stamp_ns
        if _ATTITUDE.isdisjoint(missing):
            self._attitude_ns = now
        if checked.plane is not None:
            self._plane_ns = max(self._plane_ns, checked.plane_stamp_ns)
        newest = max([line.stamp_ns for line in checked.lines], default=0)
        if newest > max(self._lines_ns, 0):
            picture = tuple([(line.rho, line.theta) for line in checked.lines])
            if supervision.is_new_picture(picture):
                self._lines_ns = newest
        attitude, rate, force = checked.attitude.tolist(), checked.angular_velocity.tolist(), checked.specific_force
        speed, down, faults = math.nan, down_in_body(attitude), dict[Fault, str]()
        if checked.velocity is not None:
            velocity = checked.velocity.tolist()
            speed = math.hypot(*velocity)
            self._descended_m += self._dt * dot(velocity, down)
        if now - self._attitude_ns > supervision.settings.imu_age_s * 1e9:
            faults[Fault.NO_ATTITUDE] = "attitude or gyro missing"
        return Tick(
            stamp_ns=now,
            imu_ns=supervision.imu_stamp(
                _INERTIAL.isdisjoint(missing), now, checked.attitude_stamp_ns, checked.imu_stamp_ns
            ),
            wrench_ns=checked.wrench_stamp_ns,
            plane_ns=self._plane_ns,
            image_ns=self._lines_ns,
            inertial=(attitude, rate, None if force is None else force.tolist()),
            wrench=checked.contact_wrench.tolist(),
            down=down,
            rate=rate,
            speed=speed,
            height=-self._descended_m,
            contact=setpoints.contact,
            press=reference.contact,
            push_reference=setpoints.push_reference,
            outcome=command.outcome,
            faults=faults,
        )
