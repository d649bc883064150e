"""Pilot: raw sensor frames in, commands out.

One tick, in the order of `Pilot._fly`: validation, tare of the wrench, perception, contact, motion in the wall plane,
strategy, reference, controller.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ibvs_qp.analytic import PaperController
from ibvs_qp.command import Command, SafetyState
from ibvs_qp.config import LONGEST_TICK, ControllerConfig, EstimationConfig, SafetySettings
from ibvs_qp.config.contact_margin import require_margin
from ibvs_qp.config.settings import choice, dump_toml, load_toml, setting, validate
from ibvs_qp.controller import HybridController
from ibvs_qp.estimation.attitude_steps import AttitudeSteps
from ibvs_qp.estimation.contact import ContactEstimator
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.inertial_fallback import InertialFallback
from ibvs_qp.estimation.stamps import HISTORY
from ibvs_qp.estimation.wall_lines import WallAxes, image_line
from ibvs_qp.estimation.wall_motion import BIAS, WallMotion
from ibvs_qp.estimation.wrench_tare import WrenchTare
from ibvs_qp.frames import Vector3, add_scaled, down_in_body, plane_in_body, roll_pitch, to_camera
from ibvs_qp.measurement import HORIZONTAL, FeatureFrame, LineReference, Measurement, Reference, RgbdFrame, SensorFrame
from ibvs_qp.model.reporting import fixed_command
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.painting.command import PainterInput, PaintingCommand
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.painter import Painter
from ibvs_qp.safety.assurance import Assurance
from ibvs_qp.safety.policy import Fault
from ibvs_qp.safety.rotor_loss import RotorLoss
from ibvs_qp.safety.tick import Tick
from ibvs_qp.validation.failure import raised
from ibvs_qp.validation.features import check_features
from ibvs_qp.validation.measurement import LINES_PER_SLOT, answered_stamp
from ibvs_qp.validation.self_check import SelfCheck
from ibvs_qp.validation.sensor_frame import SensorGate
from ibvs_qp.validation.thrust_limits import ThrustLimits
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.paper.config import PaperConfig
from ibvs_qp.vision.percept import LineHint

#: Extent of the fresh edge ahead of the brush, normalised image x from the tip's side to the border.
HINT_SPAN = (0.10, 0.50)
#: Inertial sensors of a frame.
_INERTIAL = ("attitude", "angular_velocity", "specific_force")
#: States in which the strategy flies.
_FLYING = (SafetyState.NOMINAL, SafetyState.DEGRADED)
#: Pixels by which pictures are compared: every 16th row and column, of 4096 at most.
_SPARSE = (slice(0, 4096, 16), slice(0, 4096, 16))
#: Tip to wall before the first plane [m].
ASSUMED_DISTANCE = 0.5


@dataclass(frozen=True, kw_only=True)
class CameraConfig:
    """Settings of the camera beside the intrinsics, which come with every picture."""

    latest_s: float = setting(0.30, "pictures older than this at delivery are refused", unit="s", low=0.01, high=2.0)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)


@dataclass(frozen=True, kw_only=True)
class PilotConfig:
    """Configuration of a flight."""

    controller: ControllerConfig = field(default_factory=ControllerConfig)
    camera: CameraConfig = field(default_factory=CameraConfig)
    vision: VisionConfig = field(default_factory=VisionConfig)
    estimation: EstimationConfig = field(default_factory=EstimationConfig)
    painting: PaintingConfig = field(default_factory=PaintingConfig)
    safety: SafetySettings = field(default_factory=SafetySettings)
    perception: str = choice("own", "vision pipeline: the own one or the paper's", ("own", "paper"))
    paper_vision: PaperConfig = field(default_factory=PaperConfig)
    law: str = choice("qp", "control law", ("qp", "paper"))

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)

    @classmethod
    def from_toml(cls, file: str | Path) -> PilotConfig:
        """Read a preset; one whose contact would ring is refused."""
        config = load_toml(cls, file)
        require_margin(config.controller, config.controller.brush, f"{file}: controller.")
        return config

    def to_toml(self) -> str:
        """Write the preset as TOML text."""
        return dump_toml(self)


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


class Pilot:
    """Vision, estimation, strategy and one of the two laws in a row; `step` needs no simulator.

    Args:
        config: Configuration of the flight.
        painter: Strategy to follow; None paints.
        seen_as: Applied to the features of every picture, for studies of perception errors.
        controller: Control law, for studies of other laws; None builds the configured one.
    """

    def __init__(
        self,
        config: PilotConfig | None = None,
        painter: Painter | None = None,
        seen_as: Callable[[FeatureFrame], FeatureFrame] | None = None,
        controller: Controller | None = None,
    ) -> None:
        self.config = config or PilotConfig()
        settings, vehicle = self.config.controller, self.config.controller.vehicle
        self._tip, camera = np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m)
        self._tip_camera = to_camera(self._tip, camera).tolist()
        self._tip_from_camera = (self._tip - camera).tolist()
        self._gate = SensorGate(self.config.camera.latest_s)
        self._limits = ThrustLimits(vehicle.geometry.count)
        self._most_lines = LINES_PER_SLOT * settings.line_slots
        self.self_check = SelfCheck(self.config.safety.self_check)
        self._steps = AttitudeSteps()
        self._fallback = InertialFallback(self._tip_from_camera, settings.tick_s)
        self.tare = WrenchTare(vehicle, self.config.estimation)
        self._perception, self._seen_as = None, seen_as
        self.contact = ContactEstimator(settings)
        self.motion = WallMotion(self._tip, camera, settings.tick_s, self.config.estimation)
        self.rotor_loss = RotorLoss(vehicle, settings.gains)
        self.assurance = Assurance(vehicle, self.config.safety)
        self.painter = painter or Painter(self.config.painting)
        law = HybridController if self.config.law == "qp" else PaperController
        self.controller: Controller = controller or law(settings)
        self.reset()

    def reset(self) -> None:
        """As after construction."""
        sensing = (self._gate, self.self_check, self._steps, self._fallback, self.tare, self._perception)
        flying = (self.contact, self.motion, self.rotor_loss, self.assurance, self.painter, self.controller)
        for part in (*sensing, *flying):
            if part is not None:
                part.reset()
        self._first = self._stamp = self._last_capture = -1
        self._attitude, self._rate, self._force = (self._gate.last[name] for name in _INERTIAL)
        self._turn: Vector3 = (0.0, 0.0, 0.0)  # integrated gyro [rad]
        self._history_attitude, self._history_turn = [[1.0, 0.0, 0.0, 0.0]] * HISTORY, [self._turn] * HISTORY
        self._covariance = self.motion.velocity_variance * np.eye(3)
        self._plane: tuple[float, float, float, float] | None = None
        self._plane_stamp = self._image_stamp = self._lines_stamp = self._imu_stamp = -1
        self.thrust_limits = None
        self._leaps = 0
        self._rejected: list[str] = []  # inputs of the tick that were refused before the controller
        self._commanded: Command | None = None  # of the tick, once there is one
        self.percept = None
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
        setpoints, stamp = self.setpoints, answered_stamp(frame)
        fixed = self.assurance.thrusts(setpoints.last, setpoints.floor)
        if fixed is not None:
            return self.assurance.explained(fixed_command(setpoints, stamp, fixed, ()))
        command = self.controller.step(self.measurement, self.reference)  # type: ignore[arg-type]
        return self.assurance.explained(dataclasses.replace(command, stamp_ns=stamp, rejected=()))

    def _fly(self, frame: SensorFrame) -> Command:
        """The tick of a validated frame."""
        stamp, tick_s = frame.stamp_ns, self.config.controller.tick_s
        dt = tick_s if self._stamp < 0 else min((stamp - self._stamp) * 1e-9, LONGEST_TICK)
        self._first, self._stamp = stamp if self._first < 0 else self._first, stamp
        if self._leaps != self._gate.clock.leaps:  # or the loop stood still for an unknown time
            self._leaps = self._gate.clock.leaps
            self.contact.doubt()
            self.motion.doubt()
        frame = self._inertial(frame, dt)
        attitude, rate, force = self._attitude, self._rate, self._force
        down = down_in_body(attitude)
        wrench, wrench_stamp = self._contact_wrench(frame, force)
        # After a lost rotor the vehicle turns away from the wall: its pictures show something else, and the force
        # sensor measures the tool that swings round.
        if turned := self.rotor_loss.turns(self.contact.state.normal[0]):
            wrench = np.zeros(6)
            if frame.features is not None or frame.image is not None:
                self._rejected.append("picture: the vehicle is turned from the wall")
        features = None if turned else self._perceive(frame)
        contact = self.contact.update(
            stamp_ns=stamp,
            angular_velocity=rate,
            specific_force=force,
            down=down,
            contact_wrench=wrench,
            wrench_stamp_ns=wrench_stamp,
            plane=self._plane,
            plane_stamp_ns=self._plane_stamp,
        )
        self._check_axes(contact, dt)
        axes = WallAxes.of(contact.normal, down)
        self.motion.predict(stamp, axes, force, rate, dt)
        self._remember(attitude, rate, dt)
        if features is not None:
            self._correct_motion(features, contact)
        target = self.painting_command = self._strategy(frame, contact, dt)
        self.reference = self.assurance.supervised(self._refer(target, contact))
        self.measurement = self._measure(frame, (wrench, wrench_stamp), axes, target, contact)
        begin = time.perf_counter()
        command = self._command(contact)
        self.controller_time_s = time.perf_counter() - begin
        self._commanded = self.assurance.explained(command)
        self.assurance.watch(self._shown(frame, contact, command), self.setpoints)
        return self._commanded

    def _inertial(self, frame: SensorFrame, dt: float) -> SensorFrame:
        """The frame with attitude, rate and specific force to fly by; those that fail are estimated."""
        now, fallback, setpoints = self._gate.last, self._fallback, self.setpoints
        missing = {name for name in _INERTIAL if name in self._gate.replaced}
        if Fault.IMU_FROZEN in self.assurance.faults:
            missing = set(_INERTIAL)
        if not missing:
            fallback.reset()
            self._attitude, self._rate, self._force = (now[name] for name in _INERTIAL)
            if (continuous := self._steps.update(self._attitude, self._rate, dt)) is None:
                return frame
            self._attitude = continuous
            return dataclasses.replace(frame, attitude=np.array(continuous))
        if not fallback.active:
            lines = {identity: line.angle for identity, line in self.motion.lines.items()}
            fallback.begin(self._attitude, self._rate, self.contact.state.normal, lines)
        measured = (None if name in missing else now[name] for name in _INERTIAL)
        attitude, rate, force = measured
        fallback.step(frame.stamp_ns, dt, setpoints.angular_acceleration, attitude, rate)
        self._attitude, self._rate = attitude or fallback.attitude, rate or fallback.rate
        self._force = force or setpoints.modelled_force
        values = (self._attitude, self._rate, self._force)
        return dataclasses.replace(frame, **dict(zip(_INERTIAL, map(np.array, values), strict=True)))

    def _command(self, contact: ContactState) -> Command:
        """Command of the law, or of the supervisor where it replaces the law."""
        setpoints = self.setpoints
        fixed = self.assurance.thrusts(setpoints.last, setpoints.floor)
        if fixed is not None:
            return fixed_command(setpoints, self._stamp, fixed, ())
        return self.controller.step(self.measurement, self.reference, contact)  # type: ignore[arg-type]

    def _shown(self, frame: SensorFrame, contact: ContactState, command: Command) -> Tick:
        """The tick as the monitors see it."""
        now, motion, faults = self._gate.last, self.motion, dict[Fault, str]()
        if motion.refused_s > self.config.safety.refusal_s:
            faults[Fault.FILTER_REFUSES] = f"camera velocity refused for {motion.refused_s:.1f} s"
        if self._fallback.lost:
            faults[Fault.NO_ATTITUDE] = "by motors' model and camera, too uncertain"
        if self.rotor_loss.lost:
            faults[Fault.NO_HOVER] = ""
        if found := self.self_check.faults():
            faults[Fault.INPUTS] = "; ".join(found)
        if not any(name in self._gate.replaced for name in _INERTIAL):
            self._imu_stamp = frame.stamp_ns
        right, down = motion.state[0:2]
        return Tick(
            stamp_ns=frame.stamp_ns,
            imu_ns=self._imu_stamp,
            wrench_ns=frame.wrench_stamp_ns,
            plane_ns=self.contact.plane_ns,
            image_ns=self._image_stamp,
            lines_ns=self._lines_stamp if self.reference.lines else -1,
            inertial=(now["attitude"], now["angular_velocity"], now["specific_force"]),
            wrench=now["wrench"],
            down=down_in_body(self._attitude),
            rate=self._rate,
            speed=math.hypot(right, down, contact.speed),
            height=-motion.state[5],
            contact=contact,
            press=self.reference.contact,
            push_reference=self.setpoints.push_reference,
            outcome=command.outcome,
            faults=faults,
        )

    def _contact_wrench(self, frame: SensorFrame, specific_force: list[float]) -> tuple[np.ndarray, int]:
        """Contact wrench and its time: the tared one, or that of inertial data while the sensor is faulty."""
        tared, inertial = self._tared_wrench(frame, specific_force), self.assurance.wrench(self.setpoints)
        return (tared, frame.wrench_stamp_ns) if inertial is None else (inertial, frame.stamp_ns)

    def _tared_wrench(self, frame: SensorFrame, specific_force: list[float]) -> np.ndarray:
        """Contact wrench on the vehicle [N, N m], (6,); the bias is averaged while the tip is away from the wall.

        Away by the contact of the tick before, because the contact of this tick needs the wrench.
        """
        last = self.contact.state
        free = not last.in_contact and last.distance > self.config.estimation.tare_distance_m
        return self.tare.update(frame.wrench, frame.wrench_stamp_ns, specific_force, free)

    def _check_axes(self, contact: ContactState, dt: float) -> None:
        """Self-check with those raw sensors that the tick has; it names what it found in every command."""
        now, missing, check = self._gate.last, self._gate.replaced, self.self_check
        if not any(name in missing for name in _INERTIAL):
            check.inertial(now["attitude"], now["angular_velocity"], now["specific_force"], dt)
        if "wrench" not in missing:
            check.contact(now["wrench"][:3], contact.push_noise, contact.normal, contact.distance, dt)
        self._rejected += [f"self-check: {fault}" for fault in check.faults()]

    # -------------------------------------------------------------- perception

    def _perceive(self, frame: SensorFrame) -> FeatureFrame | None:
        """Sound features of a new picture, or None; stores their plane."""
        features = frame.features if frame.image is None else self._process(frame.image)
        if features is None or (frame.image is not None and self.percept is not None and self.percept.refused):
            return None
        features = check_features(features, self._most_lines, self._rejected)
        if not self.assurance.is_news(_content(frame, features)):
            return None
        self._image_stamp = features.stamp_ns
        if features.lines:
            self._lines_stamp = features.stamp_ns
        if features.plane is not None:
            self._plane, self._plane_stamp = features.plane, features.stamp_ns
        return features

    def _process(self, image: RgbdFrame) -> FeatureFrame | None:
        """Run perception on a picture, with the gyro's turn since the last one."""
        if self._perception is None:
            self._perception = self._load_perception()
        slot = self._slot(image.stamp_ns)
        last = self._slot(self._last_capture) if self._last_capture >= 0 else slot
        self._last_capture = image.stamp_ns
        self.percept = self._perception.process(
            image,
            attitude=np.array(self._history_attitude[slot]),
            rotation=np.subtract(self._history_turn[slot], self._history_turn[last]),
            velocity=self.measurement.velocity if self.measurement is not None else None,
            hints=self._hints(image.stamp_ns),
        )
        if self.percept.refused:
            self._rejected.append(f"image: {self.percept.refused}")
        seen = self.percept.features
        return seen if self._seen_as is None or seen is None else self._seen_as(seen)

    def _load_perception(self):
        """The configured perception, loaded when the first picture comes."""
        vehicle = self.config.controller.vehicle
        if self.config.perception == "paper":
            from ibvs_qp.vision.paper import PaperPerception

            return PaperPerception(self.config.paper_vision, self.config.vision, vehicle)
        from ibvs_qp.vision.perception import Perception

        return Perception(self.config.vision, vehicle)

    def _hints(self, stamp_ns: int) -> tuple[LineHint, ...]:
        """Expected place of the fresh edge: at the brush, ahead of it, by lines and contact of the tick before."""
        expected, contact = self.painter.expected_fresh_edge(self.motion.lines), self.contact.state
        if expected is None or not contact.known:
            return ()
        offset, side = expected
        axes = WallAxes.of(contact.normal, down_in_body(self._history_attitude[self._slot(stamp_ns)]))
        rho, theta, _ = image_line(offset, 0.5 * math.pi, axes, self._tip_from_camera, contact.distance)
        near, far = HINT_SPAN
        span = (near, far) if side > 0.0 else (-far, -near)
        return (LineHint(name="fresh", rho=rho, theta=theta, kind="paint", surface_side=-1, span=span),)

    # -------------------------------------------------------------- estimation

    def _remember(self, attitude: list[float], rate: list[float], dt: float) -> None:
        """Store attitude and integrated gyro of the tick for pictures that arrive late."""
        self._turn = add_scaled(self._turn, dt, rate)
        slot = self.motion.ticks.slot(0)
        self._history_attitude[slot], self._history_turn[slot] = attitude, self._turn

    def _slot(self, stamp_ns: int) -> int:
        """Place in the history of the tick nearest to a stamp, or of the newest or the oldest one."""
        ticks = self.motion.ticks
        age = ticks.age(stamp_ns)
        if age is None:
            age = 0 if stamp_ns > self._stamp else min(HISTORY, ticks.now) - 1
        return ticks.slot(age)

    def _correct_motion(self, features: FeatureFrame, contact: ContactState) -> None:
        """Correct motion and lines at the time of capture."""
        if features.plane is not None and self.contact.plane_ns == features.stamp_ns:
            normal, distance = plane_in_body(features.plane, self._tip_from_camera)
        elif contact.known:
            normal, distance = contact.normal, contact.distance
        else:
            if features.lines:
                self._rejected.append("features.lines: not used before the first plane")
            return
        if self._fallback.active:
            self._fallback.correct(features, distance)
        gravity = down_in_body(self._history_attitude[self._slot(features.stamp_ns)])
        self.motion.correct(features, WallAxes.of(normal, gravity), distance)
        self._covariance = self.motion.velocity_variance * np.eye(3)  # changes nowhere else

    # ------------------------------------------------- strategy and controller

    def _strategy(self, frame: SensorFrame, contact: ContactState, dt: float) -> PaintingCommand:
        """Command of the painter, tilted after a lost rotor."""
        motion = self.motion
        inputs = PainterInput(
            time_s=(frame.stamp_ns - self._first) * 1e-9,
            lines=motion.lines,
            odometer=motion.state[4:6],
            velocity=motion.state[:2],
            distance=contact.distance,
            wall_known=contact.known,
            in_contact=contact.in_contact,
            time_since_touch=contact.time_since_touch,
            push=contact.push,
            push_reference=self.setpoints.push_reference,  # of the tick before: the controller runs after the painter
            tared=self.tare.ready,
        )
        limits, rotors = self._thrust_limits(), self.rotor_loss
        tilted = rotors.tilts
        if limits is not None and rotors.update(limits):
            self.painter.abandon(inputs, "no level hover is left")
        elif self.assurance.state not in _FLYING and not self.painter.descending:
            self.painter.stop(inputs, "; ".join(self.assurance.supervisor.reasons))
        target = self.painter.step(inputs)
        if not rotors.tilts:
            return target
        if not tilted:
            rotors.begin(roll_pitch(self._attitude))
        normal = np.array(contact.normal)
        away = contact.distance + float(normal @ self._tip)
        tilt = rotors.tilt(away, contact.speed, motion.state[0], normal, dt)
        return dataclasses.replace(target, tilt=tilt) if rotors.lost else dataclasses.replace(target, trim=tilt)

    def _thrust_limits(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Limits reported by the drive, within those of rotors that do not follow."""
        reported, found = self.thrust_limits, self.assurance.limits
        if reported is None or found is None:
            return found if reported is None else reported
        lower = np.maximum(reported[0], found[0])
        return lower, np.maximum(np.minimum(reported[1], found[1]), lower)

    def _refer(self, target: PaintingCommand, contact: ContactState) -> Reference:
        """Reference of a command; offsets in metres become rho = l / d at the measured distance."""
        _, tip_below, tip_ahead = self._tip_camera
        depth = tip_ahead + (contact.distance if contact.known else ASSUMED_DISTANCE)
        references = []
        for line, offset in target.guides:
            if line.role == HORIZONTAL:
                rho, theta = (offset + tip_below) / depth, 0.5 * math.pi
            else:
                rho, theta = offset / depth, 0.0
            references.append(LineReference(rho=rho, theta=theta, role=line.role))
        return Reference(
            push_force=target.push,
            standoff=target.standoff,
            lines=tuple(references),
            velocity=target.velocity,
            contact=target.contact,
            tilt=target.tilt,
            travel=target.travel,
            trim=target.trim,
        )

    def _measure(
        self,
        frame: SensorFrame,
        sample: tuple[np.ndarray, int],
        axes: WallAxes,
        target: PaintingCommand,
        contact: ContactState,
    ) -> Measurement:
        """Measurement of the tick from sensors and estimates; no velocity if the last one is too old."""
        velocity = covariance = None
        inertial = self.rotor_loss.lost or self.assurance.state not in _FLYING
        if inertial or self.motion.velocity_age_s < self.config.estimation.velocity_life_s:
            (right, down, *_), rate = self.motion.state, -contact.speed if self.rotor_loss.lost else contact.rate
            rows = zip(axes.right, axes.down, axes.normal, strict=True)
            velocity = np.array([r * right + d * down - n * rate for r, d, n in rows])
            covariance = self._covariance
        bias_right, bias_down = self.motion.state[BIAS]
        distance = contact.distance if contact.known else ASSUMED_DISTANCE
        low, high = self._thrust_limits() or (None, None)
        wrench, wrench_stamp = sample
        return Measurement(
            stamp_ns=frame.stamp_ns,
            attitude=frame.attitude,
            angular_velocity=frame.angular_velocity,
            specific_force=frame.specific_force,
            contact_wrench=wrench,
            wrench_stamp_ns=wrench_stamp,
            lines=tuple([self.motion.feature(line, axes, distance, frame.stamp_ns) for line, _ in target.guides]),
            plane=self._plane,
            plane_stamp_ns=self._plane_stamp,
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


def _content(frame: SensorFrame, features: FeatureFrame) -> object:
    """What differs from picture to picture: sparse pixels, or the features themselves."""
    if frame.image is not None:
        return frame.image.rgb[_SPARSE].tobytes(), frame.image.depth[_SPARSE].tobytes()
    return tuple(features.plane or ()), tuple([(line.rho, line.theta) for line in features.lines])
