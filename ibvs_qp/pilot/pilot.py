"""The pilot.

One tick, in the order of `Pilot._fly`: validation, tare of the wrench, perception, contact, motion in the wall plane,
strategy, reference, controller.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np

from ibvs_qp.analytic import PaperController
from ibvs_qp.command import Command, SafetyState
from ibvs_qp.config import LONGEST_TICK
from ibvs_qp.controller import HybridController
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.estimator import INERTIAL, Estimator
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.estimation.wall_lines import WallAxes, image_line
from ibvs_qp.estimation.wall_motion import BIAS
from ibvs_qp.frames import down_in_body, rotation_from_vector, to_camera
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, FeatureFrame, Measurement, Reference, RgbdFrame, SensorFrame
from ibvs_qp.model.reporting import fixed_command
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.painting.command import PainterInput, PaintingCommand
from ibvs_qp.painting.painter import Painter
from ibvs_qp.painting.reference import image_reference
from ibvs_qp.painting.strategy import Strategy, require_strategy
from ibvs_qp.pilot.camera import CameraInput
from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.pilot.contact_picture import hint_span
from ibvs_qp.pilot.push_report import PushReport
from ibvs_qp.pilot.status import Event, FlightStatus
from ibvs_qp.safety.assurance import Assurance
from ibvs_qp.safety.policy import Fault
from ibvs_qp.safety.rotor_loss import RotorLoss
from ibvs_qp.safety.tick import Tick
from ibvs_qp.validation.failure import raised
from ibvs_qp.validation.load_check import LoadCheck
from ibvs_qp.validation.measurement import answered_stamp
from ibvs_qp.validation.self_check import SelfCheck
from ibvs_qp.validation.sensor_frame import SensorGate
from ibvs_qp.validation.thrust_limits import ThrustLimits
from ibvs_qp.vision.lines.line_state import LineHint
from ibvs_qp.vision.perception_result import PerceptionResult

#: States in which the strategy flies.
_FLYING = (SafetyState.NOMINAL, SafetyState.DEGRADED)
#: Tip to wall before the first plane [m].
ASSUMED_DISTANCE = 0.5


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
    """What the law was given in a tick, and its command."""

    measurement: Measurement | None  # None before the first
    reference: Reference
    contact: ContactState | None  # None in a tick without a frame
    fixed: np.ndarray | None  # the supervisor's thrusts, which replace the law's [N], (n,); None while the law flies
    command: Command


class Pilot:
    """Vision, estimation, strategy and one of the two laws in a row; `step` needs no simulator.

    Attributes:
        observer: Called after every call of the law, for recordings; None disables it. It must not raise.

    Args:
        config: Configuration of the flight.
        painter: Strategy to follow; None paints the job of `PilotConfig.painting`.
        seen_as: Applied to the features of every picture, for studies of perception errors.
        controller: Control law, for studies of other laws; None builds the configured one.
    """

    def __init__(
        self,
        config: PilotConfig | None = None,
        painter: Strategy | None = None,
        seen_as: Callable[[FeatureFrame], FeatureFrame] | None = None,
        controller: Controller | None = None,
    ) -> None:
        self.config = config or PilotConfig()
        settings, vehicle = self.config.controller, self.config.controller.vehicle
        self._tip, camera = np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m)
        self._tip_camera = to_camera(self._tip, camera).tolist()
        self._tip_from_camera = (self._tip - camera).tolist()
        brush = self.config.vision.brush_width_m
        ways = [(role, ahead) for role in (HORIZONTAL, VERTICAL) for ahead in (-1, 1)]
        self._hint_spans = {way: hint_span(vehicle, brush, *way) for way in ways}
        self._gate = SensorGate(self.config.camera.latest_s)
        self._limits = ThrustLimits(vehicle.geometry.count)
        self.self_check = SelfCheck(self.config.safety.self_check, LoadCheck(vehicle, self.config.safety))
        turn = vehicle.force_torque_turn_deg
        self._force_axes = rotation_from_vector(np.radians(turn)) if any(turn) else None
        self.estimator = Estimator(settings, self.config.estimation)
        self.contact, self.motion = self.estimator.contact, self.estimator.motion
        self._camera = CameraInput(self.config, self.estimator, seen_as)
        self.rotor_loss = RotorLoss(vehicle, settings.gains)
        self.assurance = Assurance(vehicle, self.config.safety)
        self.push_report = PushReport()
        self.painter: Strategy = require_strategy(Painter(self.config.painting) if painter is None else painter)
        self.observer: Callable[[LawCall], None] | None = None
        law = HybridController if self.config.law == "qp" else PaperController
        self.controller: Controller = controller or law(straightened(settings))
        self.reset()

    def prepare(self, picture: RgbdFrame | None = None) -> None:
        """Load perception before a flight with pictures; without it the first pictures are refused while it loads.

        The first time it is translated into machine code, which takes seconds. Features need no perception.

        Args:
            picture: One of the camera to fly with: tables of its size and intrinsics are made, too. It is not kept.

        Raises:
            RuntimeError: When perception cannot be loaded.
        """
        self._camera.prepare(picture)

    def reset(self) -> None:
        """As after construction."""
        self._gate.reset()
        self.estimator.reset(self._gate.last)
        flying = self.rotor_loss, self.assurance, self.painter, self.controller
        for part in (self.self_check, self._camera, *flying, self.push_report):
            part.reset()
        self._first = self._stamp = self._imu_stamp = -1
        self._covariance = self.motion.velocity_variance * np.eye(3)
        self.thrust_limits = None
        self._leaps = 0
        self._rejected: list[str] = []  # inputs of the tick that were refused before the controller
        self._commanded: Command | None = None  # of the tick, once there is one
        self.measurement: Measurement | None = None
        self.reference = Reference()
        self.painting_command: PaintingCommand | None = None
        self.controller_time_s = 0.0

    @property
    def thrust_limits(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Lower and upper thrust limits that the drive reports [N], (n,) each, or None for the configured ones.

        What is assigned is checked and copied; a refused value is named in the commands and leaves the last in force.
        """
        return self._limits.accepted

    @thrust_limits.setter
    def thrust_limits(self, limits: Any) -> None:
        self._limits.assign(limits)

    @property
    def status(self) -> FlightStatus:
        """Where the flight stands after the last tick."""
        painter, supervisor = self.painter, self.assurance.supervisor
        ended = supervisor.state is SafetyState.TERMINATED
        return FlightStatus(
            phase=painter.phase,
            finished=painter.finished or ended,
            failed=painter.failed or ended,
            reason="; ".join(supervisor.reasons) if ended else painter.reason,
            safety=supervisor.state,
            events=tuple(Event(*entry) for entry in painter.log),
            push_asked_n=self.push_report.asked_n,
            push_commanded_n=self.push_report.commanded_n,
            push_flown_n=self.push_report.felt_n,
            push_reduction=self.push_report.reduction,
        )

    @property
    def picture(self) -> RgbdFrame | None:
        """The last picture as perception got it: rectified, and as of a camera that looks along +x."""
        return self._camera.picture

    @property
    def perception_result(self) -> PerceptionResult | None:
        """What perception found in the last picture."""
        return self._camera.perception_result

    @property
    def setpoints(self):
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
        self._rejected, self._commanded = [], None
        try:
            checked, refused = self._gate.check(frame)
            self._rejected += [*refused, *self._limits.rejected]
            command = self._hold(frame) if checked is None else self._gate.clock.answered(self._fly(checked))
        except Exception as error:  # in flight nothing may raise; the reason is reported instead
            self._rejected.append(raised("pilot", error))
            if (command := self._commanded) is None:
                command = self._hold(frame)
            else:  # a second one would break the rate limit
                command = dataclasses.replace(command, stamp_ns=answered_stamp(frame))
        if self._rejected:
            return dataclasses.replace(command, rejected=(*command.rejected, *self._rejected))
        return command

    def _hold(self, frame: Any) -> Command:
        """Command of a tick without a frame: the controller refuses a measurement of the same time, and holds."""
        stamp = answered_stamp(frame)
        self.assurance.miss(self.config.controller.tick_s)
        command = self._command(stamp, None)
        return self.assurance.explained(dataclasses.replace(command, stamp_ns=stamp, rejected=()))

    def _fly(self, frame: SensorFrame) -> Command:
        """The tick of a validated frame."""
        stamp, tick_s = frame.stamp_ns, self.config.controller.tick_s
        dt = tick_s if self._stamp < 0 else min((stamp - self._stamp) * 1e-9, LONGEST_TICK)
        self._first, self._stamp = stamp if self._first < 0 else self._first, stamp
        if self._leaps != self._gate.clock.leaps:  # or the loop stood still for an unknown time
            self._leaps = self._gate.clock.leaps
            self.estimator.doubt()
        frame = self._in_body(frame)
        # After a lost rotor the vehicle turns away from the wall: its pictures show something else, and the force
        # sensor measures the tool that swings round.
        if turned := self.rotor_loss.turns(self.contact.state.normal[0]):
            if frame.features is not None or frame.image is not None:
                self._rejected.append("picture: the vehicle is turned from the wall")
        features = None if turned else self._perceive(frame)
        surface_offset = self.contact.surface_offset
        contact = self.estimator.predict(
            frame,
            self._gate.last,
            self._missing(frame),
            motors=self.setpoints,
            wrench=self._wrench_in_place(frame, turned),
            plane=self._camera.plane,
            plane_ns=self._camera.plane_ns,
            press=self.reference.contact,  # of the tick before: the strategy needs the contact of this one
        )
        if self.contact.surface_offset > surface_offset:
            found = f"{contact.push:.1f} N felt {1e3 * self.contact.surface_offset:.0f} mm before the seen surface"
            self.painter.log.append((1e-9 * (stamp - self._first), "wall", f"{found}: its distance starts anew there"))
        self._check_axes(frame, contact, dt)
        if features is not None:
            if self.estimator.correct(features):
                self._covariance = self.motion.velocity_variance * np.eye(3)  # changes nowhere else
            elif features.lines:
                self._rejected.append("features.lines: not used before the first plane")
        target = self.painting_command = self._strategy(frame, contact, dt)
        self.reference = self.assurance.supervised(self._refer(target, contact))
        self.measurement = self._measure(frame, target, contact)
        begin = time.perf_counter()
        command = self._command(stamp, contact)
        self.controller_time_s = time.perf_counter() - begin
        if event := self.push_report.update(self.reference, contact, self.setpoints, command, dt):
            self.painter.log.append(((stamp - self._first) * 1e-9, *event))
        self._commanded = self.assurance.explained(command)
        self.assurance.watch(self._shown(frame, contact, command), self.setpoints)
        return self._commanded

    def _in_body(self, frame: SensorFrame) -> SensorFrame:
        """The frame with force and moment of the sensor in axes of B."""
        if self._force_axes is None:
            return frame
        force, moment = self._force_axes @ frame.wrench[:3], self._force_axes @ frame.wrench[3:]
        return dataclasses.replace(frame, wrench=np.concatenate((force, moment)))

    def _missing(self, frame: SensorFrame) -> set[str]:
        """Inertial sensors that fail."""
        if Fault.IMU_FROZEN in self.assurance.faults:
            return set(INERTIAL)
        return {name for name in INERTIAL if name in self._gate.replaced} | self._stale(frame)

    def _stale(self, frame: SensorFrame) -> set[str]:
        """Inertial sensors whose stamps are too old."""
        oldest, stale = frame.stamp_ns - round(1e9 * self.config.safety.imu_age_s), set[str]()
        if frame.attitude_stamp_ns is not None and frame.attitude_stamp_ns < oldest:
            stale.add(INERTIAL[0])
        if frame.imu_stamp_ns is not None and frame.imu_stamp_ns < oldest:
            stale.update(INERTIAL[1:])
        return stale

    def _command(self, stamp_ns: int, contact: ContactState | None) -> Command:
        """Command of the law, or of the supervisor where it replaces the law."""
        setpoints = self.setpoints
        fixed = self.assurance.thrusts(setpoints.last, setpoints.floor)
        if fixed is not None:
            command = fixed_command(setpoints, stamp_ns, fixed, ())
        else:
            command = self.controller.step(self.measurement, self.reference, contact)  # type: ignore[arg-type]
        if self.observer is not None:
            self.observer(LawCall(self.measurement, self.reference, contact, fixed, command))
        return command

    def _shown(self, frame: SensorFrame, contact: ContactState, command: Command) -> Tick:
        """The tick as the monitors see it."""
        now, motion, faults = self._gate.last, self.motion, dict[Fault, str]()
        if motion.refused_s > self.config.safety.refusal_s:
            faults[Fault.FILTER_REFUSES] = f"camera velocity refused for {motion.refused_s:.1f} s"
        if self.estimator.lost:
            faults[Fault.NO_ATTITUDE] = "by motors' model and camera, too uncertain"
        if self.rotor_loss.lost:
            faults[Fault.NO_HOVER] = ""
        if found := self.self_check.faults():
            faults[Fault.INPUTS] = "; ".join(found)
        if not any(name in self._gate.replaced for name in INERTIAL):
            stamps = frame.attitude_stamp_ns, frame.imu_stamp_ns
            self._imu_stamp = min([frame.stamp_ns, *(stamp for stamp in stamps if stamp is not None)])
        right, down = motion.state[0:2]
        return Tick(
            stamp_ns=frame.stamp_ns,
            imu_ns=self._imu_stamp,
            wrench_ns=frame.wrench_stamp_ns,
            plane_ns=self.contact.plane_ns,
            image_ns=self._camera.image_ns,
            lines_ns=self.motion.lines_ns if self.reference.lines else -1,
            inertial=(now["attitude"], now["angular_velocity"], now["specific_force"]),
            wrench=now["wrench"],
            down=self.estimator.axes.gravity,
            rate=self.estimator.rate,
            speed=math.hypot(right, down, contact.speed),
            height=-motion.state[5],
            contact=contact,
            press=self.reference.contact,
            push_reference=self.setpoints.push_reference,
            outcome=command.outcome,
            faults=faults,
            has_camera=True,
            plane_doubt=self._camera.plane_doubt,
        )

    def _wrench_in_place(self, frame: SensorFrame, turned: bool) -> tuple[np.ndarray, int] | None:
        """Contact wrench in place of the force sensor's, and its time: by inertial data while that is faulty."""
        wrench, stamp = self.assurance.wrench(self.setpoints), frame.stamp_ns
        if turned:
            return np.zeros(6), frame.wrench_stamp_ns if wrench is None else stamp
        return None if wrench is None else (wrench, stamp)

    def _check_axes(self, frame: SensorFrame, contact: ContactState, dt: float) -> None:
        """Self-check with those raw sensors that the tick has; it names what it found in every command."""
        now, missing, check = self._gate.last, self._gate.replaced, self.self_check
        if not any(name in missing for name in INERTIAL):
            check.inertial(now["attitude"], now["angular_velocity"], now["specific_force"], dt)
        if "wrench" not in missing:
            free = contact.known and contact.distance > self.config.estimation.tare_distance_m
            noted = check.note
            check.load(frame.wrench, frame.wrench_stamp_ns, self.estimator.force, free, dt)
            if check.note != noted:
                self.painter.log.append((1e-9 * (self._stamp - self._first), "force sensor", check.note))
            check.contact(frame.wrench[:3].tolist(), contact.push_noise, contact.normal, contact.distance, dt)
        self._rejected += [f"self-check: {fault}" for fault in check.faults()]

    # -------------------------------------------------------------- perception

    def _perceive(self, frame: SensorFrame) -> FeatureFrame | None:
        """Sound features of a new picture, or None."""
        velocity = self.measurement.velocity if self.measurement is not None else None
        hints = () if frame.image is None else self._hints(frame.image.stamp_ns)
        return self._camera.perceive(frame, velocity, hints, self.assurance.is_news, self._rejected)

    def _hints(self, stamp_ns: int) -> tuple[LineHint, ...]:
        """Expected place of a painted edge beside the brush, by lines and contact of the tick before."""
        expected, contact = self.painter.expected_edge(), self.contact.state
        if expected is None or not contact.known:
            return ()
        axes = WallAxes.of(contact.normal, down_in_body(self.estimator.attitude_at(stamp_ns)))
        level = expected.role == HORIZONTAL
        angle = 0.5 * math.pi if level else 0.0
        rho, theta, _ = image_line(expected.offset, angle, axes, self._tip_from_camera, contact.distance)
        span = self._hint_spans[expected.role, expected.ahead]
        if span[0] >= span[1]:
            return ()
        return (LineHint(name="fresh", rho=rho, theta=theta, kind="paint", surface_side=expected.side, span=span),)

    # ------------------------------------------------- strategy and controller

    def _strategy(self, frame: SensorFrame, contact: ContactState, dt: float) -> PaintingCommand:
        """Command of the strategy, tilted after a lost rotor."""
        motion = self.motion
        inputs = PainterInput(
            time_s=(frame.stamp_ns - self._first) * 1e-9,
            lines=MappingProxyType(motion.lines),  # a strategy of the user's must not lose lines of the filter
            odometer=motion.state[4:6],
            velocity=motion.state[:2],
            distance=contact.distance,
            wall_known=contact.known,
            in_contact=contact.in_contact,
            time_since_touch=contact.time_since_touch,
            push=contact.push,
            push_reference=self.setpoints.push_reference,  # of the tick before: the controller runs after the strategy
            tared=self.estimator.tared,
        )
        if self.rotor_loss.update(self.assurance.limits(self.thrust_limits)):
            self.painter.abandon(inputs, "no level hover is left")
        elif self.assurance.state not in _FLYING and not self.painter.descending:
            self.painter.stop(inputs, "; ".join(self.assurance.supervisor.reasons))
        target = self.painter.fly(inputs)
        if self.painter.fault:
            self._rejected.append(self.painter.fault)
        attitude = self.rotor_loss.target(contact, self.estimator.attitude, motion.state[0], dt)
        return dataclasses.replace(target, **attitude) if attitude else target

    def _refer(self, target: PaintingCommand, contact: ContactState) -> Reference:
        """Reference of a command at the measured distance."""
        tip_right, tip_below, tip_ahead = self._tip_camera
        depth = tip_ahead + (contact.distance if contact.known else ASSUMED_DISTANCE)
        return image_reference(target, depth, tip_below, tip_right)

    def _measure(
        self,
        frame: SensorFrame,
        target: PaintingCommand,
        contact: ContactState,
    ) -> Measurement:
        """Measurement of the tick from sensors and estimates; no velocity if the last one is too old."""
        estimator, velocity, covariance = self.estimator, None, None
        axes = estimator.axes
        inertial = self.rotor_loss.lost or self.assurance.state not in _FLYING
        if inertial or self.motion.velocity_age_s < self.config.estimation.velocity_life_s:
            (right, down, *_), rate = self.motion.state, -contact.speed if self.rotor_loss.lost else contact.rate
            rows = zip(axes.right, axes.down, axes.normal, strict=True)
            velocity = np.array([r * right + d * down - n * rate for r, d, n in rows])
            covariance = self._covariance
        bias_right, bias_down = self.motion.state[BIAS]
        distance = contact.distance if contact.known else ASSUMED_DISTANCE
        low, high = self.assurance.limits(self.thrust_limits) or (None, None)
        return Measurement(
            stamp_ns=frame.stamp_ns,
            attitude=np.array(estimator.attitude),
            angular_velocity=np.array(estimator.rate),
            specific_force=np.array(estimator.force),
            contact_wrench=np.array(estimator.wrench),
            wrench_stamp_ns=estimator.wrench_ns,
            lines=tuple([self.motion.feature(line, axes, distance, frame.stamp_ns) for line, _ in target.guides]),
            plane=self._camera.plane and self.contact.on_felt_surface(self._camera.plane),
            plane_stamp_ns=self._camera.plane_ns,
            velocity=velocity,
            velocity_covariance=covariance,
            acceleration_bias=np.array(
                [bias_right * r + bias_down * d for r, d in zip(axes.right, axes.down, strict=True)]
            ),
            thrust_min=low,
            thrust_max=high,
            attitude_stamp_ns=frame.attitude_stamp_ns,
            imu_stamp_ns=frame.imu_stamp_ns,
        )
