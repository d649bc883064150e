"""The pilot: raw sensor frames in, commands out; the stages of a tick stand in their order in `Pilot._fly`."""

from __future__ import annotations

import dataclasses
import functools
import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from ibvs_qp.analytic import PaperController
from ibvs_qp.checked_law import CheckedLaw
from ibvs_qp.command import Command, SafetyState
from ibvs_qp.config import LONGEST_TICK
from ibvs_qp.controller import HybridController
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.estimator import INERTIAL
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.flight_state import FlightState, Rebuilt, copied, put_state, take_state
from ibvs_qp.measurement import FeatureFrame, Measurement, Reference, RgbdFrame, SensorFrame
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.pilot.camera import CameraInput
from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.pilot.estimation import Estimation
from ibvs_qp.pilot.painting.strategy import Strategy
from ibvs_qp.pilot.planning import FLYING, Planning
from ibvs_qp.pilot.push_report import PushReport
from ibvs_qp.pilot.status import Event, FlightStatus
from ibvs_qp.supervision.faults import Fault
from ibvs_qp.supervision.monitors import Tick
from ibvs_qp.supervision.supervision import Limits, Supervision
from ibvs_qp.validation.failure import raised
from ibvs_qp.validation.load_check import LoadCheck
from ibvs_qp.validation.measurement import answered_stamp
from ibvs_qp.validation.sensor_frame import SensorGate
from ibvs_qp.validation.thrust_limits import ThrustLimits
from ibvs_qp.vision.perception import PerceptionResult


class Controller(Protocol):
    """A control law of the pilot; it never raises and never leaves the thrust limits."""

    @property
    def setpoints(self) -> Setpoints:
        """Set-points of the last step."""
        ...

    def reset(self) -> None:
        """As after construction."""
        ...

    def step(self, measurement: Measurement, reference: Reference, contact: ContactState | None = None) -> Command:
        """Thrusts for one tick."""
        ...


class LawCall(NamedTuple):
    """Inputs of the law in a tick, and its command."""

    measurement: Measurement | None  # None before the first
    reference: Reference
    contact: ContactState | None  # None in a tick without a frame
    fixed: np.ndarray | None  # the supervisor's thrusts in place of the law's [N], (n,); None while the law has control
    command: Command


class Pilot(Rebuilt):
    """Vision, estimation, strategy and one of the two laws in a row; `step` needs no simulator.

    Attributes:
        camera: Perception input: pictures or features of the flight.
        estimation: Filters, and the measurement of a tick; of them `contact`, and `motion` along the wall.
        planning: Strategy and reference.
        supervision: Monitors, state machine and reactions; of it `self_check` (of the sensors' axes).
        controller: The law.
        push_report: Push asked, commanded and felt.
        measurement, reference: Inputs of the law in the last tick; None before the first.
        controller_time_s: Duration of the law in the last tick [s].
        observer: Called after every call of the law, for recordings; None disables it. It must not raise.

    Args:
        config: Configuration of the flight.
        painter: Strategy to follow; None paints the job of `PilotConfig.painting`.
        seen_as: Applied to the features of every picture, for studies of perception errors.
        controller: Control law, for studies of other laws; None builds the configured one.
    """

    CONSTANTS = ("observer", "_commanded", "_seen_as")

    def __init__(
        self,
        config: PilotConfig | None = None,
        painter: Strategy | None = None,
        seen_as: Callable[[FeatureFrame], FeatureFrame] | None = None,
        controller: Controller | None = None,
    ) -> None:
        self.config, self._seen_as = (config := config or PilotConfig()), seen_as
        settings, vehicle = config.controller, config.controller.vehicle
        self._gate, self._limits = SensorGate(config.camera.latest_s), ThrustLimits(vehicle.geometry.count)
        self.estimation = estimation = Estimation(config, self._gate)
        self.estimator, self.contact, self.motion = estimation.estimator, estimation.contact, estimation.motion
        self.camera = CameraInput(config, estimation.estimator, seen_as)
        self.planning = Planning(config, painter)
        self.supervision = Supervision(settings, config.safety, LoadCheck(vehicle, config.safety))
        self.self_check, self.push_report = self.supervision.self_check, PushReport()
        self.observer: Callable[[LawCall], None] | None = None
        law = HybridController if config.law == "qp" else PaperController
        self.controller: Controller = controller or law(straightened(settings))
        self.reset()

    def prepare(self, picture: RgbdFrame | None = None) -> None:
        """Load perception before a flight with pictures; without it the first pictures are refused while it loads.

        The first time it is translated into machine code, which takes seconds. Features need no perception.

        Args:
            picture: Picture of the camera of the flight: tables of its size and intrinsics are made, too. It is not
                kept.

        Raises:
            RuntimeError: When perception cannot be loaded.
        """
        self.camera.prepare(picture)

    def reset(self) -> None:
        """As after construction."""
        stages = (self.estimation, self.camera, self.planning, self.supervision, self.controller)
        for part in (self._gate, self._limits, *stages, self.push_report):
            part.reset()
        self._first_ns = self._stamp_ns = -1
        self._jumps = 0
        self._commanded: Command | None = None  # of the tick, once there is one
        self.measurement: Measurement | None = None
        self.reference = Reference()
        self.controller_time_s = 0.0

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are built anew and continue from the state; the observer stays with the original."""
        make = self._make  # of a subclass with a constructor of its own
        if type(self).__init__ is Pilot.__init__:
            make = functools.partial(type(self), self.config, self.painter, self._seen_as, self.controller)
        return copied, (make, self.state())

    def state(self) -> FlightState:
        """Everything that changes from tick to tick; `restore` of this or an equal pilot continues from it.

        The solver sets up anew after it, here as in every copy: later thrusts may differ in their last bits from those
        without a snapshot, but not from copy to copy. A strategy's state is all of its attributes but functions.
        """
        return take_state(self, self.config)

    def restore(self, state: FlightState) -> None:
        """Continue from a state, bit-identical to the pilot that it is of; loads perception if that had it loaded.

        Raises:
            ConfigError: When it is of another class, configuration, strategy or law.
            RuntimeError: When perception cannot be loaded.
        """
        if isinstance(state, FlightState) and "camera._loader.perception" in state.values:
            self.camera.load_perception()
        put_state(self, self.config, state)

    @property
    def thrust_limits(self) -> Limits | None:
        """Lower and upper thrust limits that the drive reports [N], (n,) each, or None for the configured ones.

        The value is checked and copied; a refused one is named in the commands, and the last one stays in force.
        """
        return self._limits.accepted

    @thrust_limits.setter
    def thrust_limits(self, limits: Any) -> None:
        self._limits.assign(limits)

    @property
    def status(self) -> FlightStatus:
        """Where the flight stands after the last tick."""
        painter, supervisor, report = self.painter, self.supervision.supervisor, self.push_report
        ended = supervisor.state is SafetyState.TERMINATED
        return FlightStatus(
            phase=painter.phase,
            finished=painter.finished or ended,
            failed=painter.failed or ended,
            reason="; ".join(supervisor.reasons) if ended else painter.reason,
            safety=supervisor.state,
            events=tuple(Event(*entry) for entry in painter.log),
            push_asked_n=report.asked_n,
            push_commanded_n=report.commanded_n,
            push_flown_n=report.felt_n,
            push_reduction=report.reduction,
        )

    @property
    def waits_for(self) -> str:
        """Condition for which the strategy's phase waits; empty at its end, or for none that is known."""
        return self.planning.waits_for(self.estimation, self.setpoints.push_reference)

    @property
    def painter(self) -> Strategy:
        """The strategy."""
        return self.planning.painter

    @painter.setter
    def painter(self, painter: Strategy) -> None:
        self.planning.painter = painter

    @property
    def picture(self) -> RgbdFrame | None:
        """The last picture as perception got it: rectified, and as of a camera that looks along +x."""
        return self.camera.picture

    @property
    def perception_result(self) -> PerceptionResult | None:
        """Result of perception for the last picture."""
        return self.camera.perception_result

    @property
    def setpoints(self) -> Setpoints:
        """The controller's set-points, for logs."""
        return self.controller.setpoints

    @np.errstate(all="ignore")  # a host may have numpy raise at every underflow
    def step(self, frame: SensorFrame) -> Command:
        """One control tick; never raises. Inputs are copied, so the caller may reuse its arrays.

        Args:
            frame: Raw sensors; image or features only when there is a new picture.

        Returns:
            The controller's command.
        """
        rejected: list[str] = []  # inputs that were refused before the controller
        self._commanded = None
        try:
            checked, refused = self._gate.check(frame)
            rejected += [*refused, *self._limits.rejected]
            command = self._hold(frame) if checked is None else self._gate.clock.answered(self._fly(checked, rejected))
        except Exception as error:  # in flight nothing may raise; the reason is reported instead
            rejected.append(raised("pilot", error))
            if (command := self._commanded) is None:
                command = self._hold(frame)
            else:  # a second one would break the rate limit
                command = dataclasses.replace(command, stamp_ns=answered_stamp(frame))
        if rejected:
            return dataclasses.replace(command, rejected=(*command.rejected, *rejected))
        return command

    def _hold(self, frame: Any) -> Command:
        """Command of a tick without a frame: the controller refuses a measurement of the same time, and holds."""
        stamp = answered_stamp(frame)
        self.supervision.miss()
        command = self._command(stamp, None)
        return self.supervision.explained(dataclasses.replace(command, stamp_ns=stamp, rejected=()))

    def _fly(self, frame: SensorFrame, rejected: list[str]) -> Command:
        """The tick of a validated frame."""
        estimation, planning, supervision, setpoints = self.estimation, self.planning, self.supervision, self.setpoints
        stamp, dt = frame.stamp_ns, self._advance(frame.stamp_ns)
        # perceive: after a lost rotor the vehicle turns away from the wall, its pictures show something else
        turned = supervision.rotor_loss.turns(self.contact.state.normal[0])
        features = self._perceive(frame, turned, rejected)
        # estimate
        frame, plane = estimation.in_body(frame), (self.camera.plane, self.camera.plane_ns)
        wrench = supervision.replaced_wrench(frame.wrench_stamp_ns, stamp, turned, setpoints)
        frozen, press = Fault.IMU_FROZEN in supervision.faults, self.reference.contact
        contact, found = estimation.predict(frame, setpoints, plane, wrench, frozen=frozen, press=press)
        planning.note("wall", found)
        rejected += self._check_axes(frame, contact, dt)
        if features is not None:
            estimation.correct(features, rejected)
        # plan
        limits = supervision.limits(self.thrust_limits)
        target = planning.plan(estimation, supervision, limits, setpoints.push_reference, dt, rejected)
        self.reference = supervision.reference(planning.reference(target, contact, estimation.estimator.curvature))
        # measure
        turning = supervision.rotor_loss.lost
        drifting = turning or supervision.state not in FLYING
        self.measurement = estimation.measurement(
            frame, target.guides, plane, limits, drifting=drifting, turning=turning
        )
        # law
        begin = time.perf_counter()
        command = self._command(stamp, contact)
        self.controller_time_s = time.perf_counter() - begin
        if event := self.push_report.update(self.reference, contact, setpoints, command, dt):
            planning.note(*event)
        # supervise
        self._commanded = supervision.explained(command)
        noted = supervision.rotor_note
        supervision.watch(self._tick(frame, contact, command), setpoints)
        if supervision.rotor_note != noted:
            planning.note("rotor", supervision.rotor_note)
        return self._commanded

    def _advance(self, stamp_ns: int) -> float:
        """Begin a tick; time since the last one [s]."""
        dt = self.config.controller.tick_s
        if self._stamp_ns >= 0:
            dt = min((stamp_ns - self._stamp_ns) * 1e-9, LONGEST_TICK)
        self._first_ns, self._stamp_ns = stamp_ns if self._first_ns < 0 else self._first_ns, stamp_ns
        self.planning.time_s = (stamp_ns - self._first_ns) * 1e-9
        if self._jumps != self._gate.clock.jumps:  # or the loop stood still for an unknown time
            self._jumps = self._gate.clock.jumps
            self.estimator.doubt()
        return dt

    def _perceive(self, frame: SensorFrame, turned: bool, rejected: list[str]) -> FeatureFrame | None:
        """Sound features of a new picture, or None."""
        if turned:
            if frame.features is not None or frame.image is not None:
                rejected.append("picture: the vehicle is turned from the wall")
            return None
        velocity = self.measurement.velocity if self.measurement is not None else None
        hints = ()
        if frame.image is not None:
            hints = self.camera.hints(frame.image.stamp_ns, self.painter.expected_edge(), self.contact.state)
        return self.camera.perceive(frame, velocity, hints, self.supervision.is_new_picture, rejected)

    def _check_axes(self, frame: SensorFrame, contact: ContactState, dt: float) -> tuple[str, ...]:
        """Self-check with the raw sensors of the tick; returns the findings."""
        now, missing, check = self._gate.last, self._gate.replaced, self.self_check
        inertial = force = None
        if missing.isdisjoint(INERTIAL):
            inertial = now["attitude"], now["angular_velocity"], now["specific_force"]
        if "wrench" not in missing:
            force, noted = frame.wrench[:3].tolist(), check.note
            free = contact.known and contact.distance > self.config.estimation.tare_distance_m
            check.load(frame.wrench, frame.wrench_stamp_ns, self.estimator.force, free, dt)
            if check.note != noted:
                self.planning.note("force sensor", check.note)
        return self.supervision.check_axes(inertial, force, contact, dt)

    def _command(self, stamp_ns: int, contact: ContactState | None) -> Command:
        """Command of the law, or of the supervisor where it replaces the law."""
        measurement, reference = self.measurement, self.reference
        law: Any = self.controller

        def answer() -> Command:
            if contact is not None and getattr(law.step, "__func__", None) is CheckedLaw.step:
                return law.answer(measurement, reference, contact, trusted=True)  # checked in frame and strategy
            return law.step(measurement, reference, contact)

        command, fixed = self.supervision.command(answer, law.setpoints, stamp_ns)
        if self.observer is not None:
            self.observer(LawCall(measurement, reference, contact, fixed, command))
        return command

    def _tick(self, frame: SensorFrame, contact: ContactState, command: Command) -> Tick:
        """Inputs of the monitors."""
        now, motion, estimator, faults = self._gate.last, self.motion, self.estimator, dict[Fault, str]()
        if motion.refused_s > self.config.safety.refusal_s:
            faults[Fault.FILTER_REFUSES] = f"camera velocity refused for {motion.refused_s:.1f} s"
        if estimator.lost:
            faults[Fault.NO_ATTITUDE] = "by motors' model and camera, too uncertain"
        sampled = self._gate.replaced.isdisjoint(INERTIAL)
        right, down = motion.state[0:2]
        return Tick(
            stamp_ns=frame.stamp_ns,
            imu_ns=self.supervision.imu_stamp(sampled, frame.stamp_ns, frame.attitude_stamp_ns, frame.imu_stamp_ns),
            wrench_ns=frame.wrench_stamp_ns,
            plane_ns=self.contact.plane_ns,
            image_ns=self.camera.image_ns,
            lines_ns=motion.lines_ns if self.reference.lines else -1,
            inertial=(now["attitude"], now["angular_velocity"], now["specific_force"]),
            wrench=now["wrench"],
            down=estimator.axes.gravity,
            rate=estimator.rate,
            speed=math.hypot(right, down, contact.speed),
            height=-motion.state[5],
            contact=contact,
            press=self.reference.contact,
            push_reference=self.setpoints.push_reference,
            outcome=command.outcome,
            faults=faults,
            has_camera=True,
            plane_doubt=self.camera.plane_doubt,
        )
