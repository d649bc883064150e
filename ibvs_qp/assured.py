"""Assured: a controller under supervision, for loops without a `Pilot`."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from ibvs_qp.checked_law import CheckedLaw, Inputs
from ibvs_qp.command import Command, SafetyState
from ibvs_qp.config import LONGEST_TICK, SafetySettings
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.frames import dot, down_in_body
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.reporting import fixed_command, hover_command
from ibvs_qp.safety.assurance import Assurance
from ibvs_qp.safety.policy import Fault
from ibvs_qp.safety.rotor_loss import RotorLoss
from ibvs_qp.safety.tick import Tick
from ibvs_qp.validation.failure import raised
from ibvs_qp.validation.measurement import answered_stamp
from ibvs_qp.validation.self_check import SelfCheck

#: Fields without which a measurement has no inertial sample.
_ATTITUDE = ("attitude", "angular_velocity")
_INERTIAL = ("attitude", "angular_velocity", "specific_force")


class Assured:
    """Monitors and supervisor around a controller, with the same `step`; one line to add to a loop.

    ``controller = Assured(HybridController(config))``

    Ages follow from the stamps of the measurement: attitude and inertial sensors, wrench, plane once one was given,
    and lines once one with a stamp was given.

    Args:
        controller: The controller to supervise.
        settings: Bounds of the monitors and motions of the states.
    """

    def __init__(self, controller: CheckedLaw, settings: SafetySettings | None = None) -> None:
        self.controller = controller
        vehicle, gains = controller.config.vehicle, controller.config.gains
        self.assurance = Assurance(vehicle, settings or SafetySettings())
        self.self_check = SelfCheck(self.assurance.settings.self_check)
        self._rotors = RotorLoss(vehicle, gains)
        self.reset()

    def reset(self) -> None:
        """As after construction."""
        self.controller.reset()
        self.assurance.reset()
        self.self_check.reset()
        self._rotors.reset()
        self._attitude_ns = self._imu_ns = self._wrench_ns = self._plane_ns = self._lines_ns = -1
        self._descended_m, self._time_ns, self._dt = 0.0, -1, 0.0

    @np.errstate(all="ignore")  # a host may have numpy raise at every underflow
    def step(self, measurement: Measurement, reference: Reference, contact: ContactState | None = None) -> Command:
        """Thrusts for one tick, as `HybridController.step`; ``Command.safety`` is the state of the supervisor."""
        stamp, command = answered_stamp(measurement), None
        try:
            inputs = self.controller.check(measurement, reference, contact)
            if self.assurance.state is not SafetyState.NOMINAL:
                inputs = inputs._replace(reference=self.assurance.supervised(inputs.reference))
            if inputs.measurement is not None:
                now, tick_s = inputs.measurement.stamp_ns, self.controller.config.tick_s
                self._dt, self._time_ns = (now - self._time_ns) * 1e-9 if self._time_ns >= 0 else tick_s, now
                inputs = self._with_rotors(inputs, inputs.measurement)
            command = self._command(inputs)
            shown = self.assurance.explained(command)
            if inputs.measurement is None:
                self.assurance.miss(self.controller.config.tick_s)
                return shown
            found = self._check_axes(inputs.measurement)
            if found:
                named = tuple([f"self-check: {fault}" for fault in found])
                shown = dataclasses.replace(shown, rejected=(*shown.rejected, *named))
            tick = self._tick(inputs.measurement, command, inputs.reference)
            if found:
                tick.faults[Fault.INPUTS] = "; ".join(found)
            self.assurance.watch(tick, self.controller.setpoints)
            return self.controller.gate.clock.answered(shown)
        except Exception as error:  # in flight nothing may raise; thrusts that were found are not replaced
            if command is None:
                command = hover_command(self.controller.setpoints, stamp, self.controller.gate.inertial, ())
                self.assurance.miss(self.controller.config.tick_s)
            rejected = (*command.rejected, raised("assured", error))
            return self.assurance.explained(dataclasses.replace(command, stamp_ns=stamp, rejected=rejected))

    def _command(self, inputs: Inputs) -> Command:
        """Command of the law, or of the supervisor where it replaces the law."""
        setpoints, checked = self.controller.setpoints, inputs.measurement
        fixed = self.assurance.thrusts(setpoints.last, setpoints.floor)
        if fixed is not None:
            stamp_ns = inputs.stamp_ns if checked is None else checked.stamp_ns
            return fixed_command(setpoints, stamp_ns, fixed, inputs.rejected)
        inertial = self.assurance.wrench(setpoints)
        if checked is not None and inertial is not None:
            checked = dataclasses.replace(checked, contact_wrench=inertial, wrench_stamp_ns=checked.stamp_ns)
            inputs = inputs._replace(measurement=checked)
        return self.controller.respond(inputs)

    def _with_rotors(self, inputs: Inputs, checked: Measurement) -> Inputs:
        """Inputs with the limits of rotors that do not follow, and with the attitude at which those left carry it."""
        setpoints, rotors = self.controller.setpoints, self._rotors
        low, high, found = checked.thrust_min, checked.thrust_max, self.assurance.limits(None)
        limited = low is not None or high is not None or found is not None
        if not (limited or rotors.tilts) or not self.assurance.settings.supervise:
            return inputs
        changes: dict[str, np.ndarray] = {}
        if limited:
            low, high = setpoints.floor if low is None else low, setpoints.ceiling if high is None else high
            low, high = self.assurance.limits((low, high)) or (low, high)
            rotors.update((low, high))
            if found is not None:
                changes = {"thrust_min": low, "thrust_max": high}
        contact, velocity = setpoints.contact, checked.velocity
        if rotors.turns(contact.normal[0]):  # the force sensor measures the tool that swings round
            changes["contact_wrench"] = np.zeros(6)
        along = 0.0 if velocity is None else float(setpoints.right @ velocity)
        if attitude := rotors.target(contact, checked.attitude.tolist(), along, min(self._dt, LONGEST_TICK)):
            inputs = inputs._replace(reference=dataclasses.replace(inputs.reference, **attitude))
        return inputs._replace(measurement=dataclasses.replace(checked, **changes)) if changes else inputs

    def _tick(self, checked: Measurement, command: Command, reference: Reference) -> Tick:
        """The tick as the monitors see it, in monotonic time."""
        gate, setpoints = self.controller.gate, self.controller.setpoints
        now = checked.stamp_ns
        missing = gate.replaced
        if not (missing and any(name in missing for name in _ATTITUDE)):
            self._attitude_ns = now
        if not (missing and any(name in missing for name in _INERTIAL)):
            attitude_ns, imu_ns = checked.attitude_stamp_ns, checked.imu_stamp_ns
            self._imu_ns = min(now if attitude_ns is None else attitude_ns, now if imu_ns is None else imu_ns)
        self._wrench_ns = checked.wrench_stamp_ns
        if checked.plane is not None:
            self._plane_ns = max(self._plane_ns, checked.plane_stamp_ns)
        newest = max([line.stamp_ns for line in checked.lines], default=0)
        if newest > max(self._lines_ns, 0):
            picture = tuple([(line.rho, line.theta) for line in checked.lines])
            if self.assurance.is_news(picture):
                self._lines_ns = newest
        attitude, rate, force = checked.attitude.tolist(), checked.angular_velocity.tolist(), checked.specific_force
        speed, down = math.nan, down_in_body(attitude)
        if checked.velocity is not None:
            velocity = checked.velocity.tolist()
            speed = math.hypot(*velocity)
            self._descended_m += self._dt * dot(velocity, down)
        faults: dict[Fault, str] = {}
        if now - self._attitude_ns > self.assurance.settings.imu_age_s * 1e9:
            faults[Fault.NO_ATTITUDE] = "attitude or gyro missing"
        if self._rotors.lost:
            faults[Fault.NO_HOVER] = ""
        return Tick(
            stamp_ns=now,
            imu_ns=self._imu_ns,
            wrench_ns=self._wrench_ns,
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

    def _check_axes(self, checked: Measurement) -> tuple[str, ...]:
        """Self-check with those sensors that the tick has; the contact wrench is that of the tool on the vehicle."""
        check, contact, dt = self.self_check, self.controller.setpoints.contact, self._dt
        if check.done:
            return ()
        missing = self.controller.gate.replaced
        if checked.specific_force is not None and not (missing and any(name in missing for name in _INERTIAL)):
            check.inertial(
                checked.attitude.tolist(), checked.angular_velocity.tolist(), checked.specific_force.tolist(), dt
            )
        if "contact_wrench" not in missing:
            tool = (-checked.contact_wrench[:3]).tolist()
            check.contact(tool, contact.push_noise, contact.normal, contact.distance, dt)
        return check.faults()
