"""The bridge: messages of the vehicle in, commands of the pilot out, once a tick."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from ibvs_qp.command import SafetyState
from ibvs_qp.interfaces.px4.config import BridgeConfig
from ibvs_qp.interfaces.px4.dds import Participant
from ibvs_qp.interfaces.px4.inputs import MODE, PAIR, Inputs
from ibvs_qp.interfaces.px4.outputs import Outputs, publications
from ibvs_qp.pilot import Pilot, PilotConfig
from ibvs_qp.validation.self_check import SelfCheck


class BridgeState(StrEnum):
    """State of the bridge; it sends proof of life while ready and flying, setpoints while flying, else nothing."""

    WAITING = "waiting"
    CHECKING = "checking"
    READY = "ready"
    FLYING = "flying"
    STOPPED = "stopped"


class Gate:
    """State machine of the bridge, with the reason of its state.

    PX4 refuses Offboard mode without proof of life, so holding that back keeps PX4 from arming in Offboard and from
    switching to it. The bridge never arms, and never resumes by itself after a stop: PX4 must have left Offboard mode
    first.

    Args:
        check_s: Time without a fault before the bridge is ready [s].
    """

    def __init__(self, check_s: float) -> None:
        self._check_ns = round(1e9 * check_s)
        self._sound_ns: int | None = None  # since when nothing is missing and there is no fault
        self._fault = ""  # the last one of this preparation
        self.state, self.reason = BridgeState.WAITING, "no message yet"

    def update(self, now_ns: int, lost: Sequence[str], missing: Sequence[str], engaged: bool | None) -> BridgeState:
        """Go to the state of a tick.

        Args:
            now_ns: Time of the tick [ns].
            lost: Inputs that are too old and needed in flight.
            missing: Other reasons not to be ready: old inputs, faults of the self-check.
            engaged: Whether PX4 is armed and in Offboard mode; None if its mode is too old.
        """
        if self.state is BridgeState.FLYING and (lost or engaged is None):
            self.stop(f"link lost: {', '.join(lost) or 'mode of PX4'}")
        elif self.state in (BridgeState.FLYING, BridgeState.STOPPED):
            if engaged is False:
                self.state, self.reason = BridgeState.CHECKING, "PX4 left Offboard mode"
                self._sound_ns, self._fault = None, ""
        else:
            self._prepare(now_ns, [*lost, *missing], engaged)
        return self.state

    def stop(self, reason: str) -> None:
        """Send nothing from now on, so that PX4's failsafe for a lost Offboard signal takes over."""
        self.state, self.reason = BridgeState.STOPPED, reason

    def _prepare(self, now_ns: int, problems: Sequence[str], engaged: bool | None) -> None:
        if self.state is BridgeState.READY and not problems and engaged:
            self.state, self.reason = BridgeState.FLYING, "PX4 is armed and in Offboard mode"
            return
        if engaged is None:
            problems = [*problems, "mode of PX4"]
        elif engaged:
            problems = [*problems, "PX4 is armed and in Offboard mode already"]
        if problems:
            self.state, self.reason, self._sound_ns = BridgeState.WAITING, ", ".join(problems), None
            self._fault = f"; last fault: {self.reason}"
            return
        if self._sound_ns is None:
            self._sound_ns = now_ns
        if now_ns - self._sound_ns >= self._check_ns:
            self.state, self.reason = BridgeState.READY, "switch PX4 to Offboard mode"
        else:
            self.state, self.reason = BridgeState.CHECKING, f"self-check{self._fault}"


#: Sensors that are needed in flight.
_INERTIAL = ("imu", "attitude")


def checks(config: BridgeConfig, flight: PilotConfig) -> tuple[str, ...]:
    """Conditions of a bridge that is ready, in words."""
    return (
        f"imu and attitude arrived within {config.link_timeout_s:g} s, wrench and pictures within "
        f"{config.sensor_timeout_s:g} s, PX4's mode within {config.mode_timeout_s:g} s",
        "their stamps are of this computer's clock",
        f"imu and attitude were at most {1e3 * flight.safety.imu_age_s:g} ms old by their stamps in every tick of the "
        "self-check",
        f"colour and depth are pairs, by stamps within {1e3 * config.topics.pair_s:g} ms, of the size in camera_info",
        "camera_info has the lens of the preset (camera.distortion)",
        f"the vehicle was at rest or hovered, and for {config.check_s:g} s attitude, gyro and accelerometer agreed",
        "PX4 was not armed in Offboard mode before",
    )


@dataclass(frozen=True, kw_only=True)
class BridgeStatus:
    """State of the bridge."""

    state: BridgeState
    reason: str
    phase: str  # of the flight, empty unless flying
    safety: str  # state of the pilot's supervisor and its reasons, empty unless flying
    commands: int  # ticks with setpoints
    ignored: dict[str, int]  # messages left out, by role and reason


class Bridge:
    """Flies a pilot on DDS messages. `tick` never raises because of a message.

    Attributes:
        tick_s: Control period [s].

    Args:
        config: Settings.
        flight: Configuration of the flight.
        clock: Clock of the stamps [ns]: that of ROS, to which PX4's stamps are synchronised.
        pilot: Pilot to run; None builds it. Its perception is loaded here, and prepared for the first picture.

    Raises:
        ConfigError: When DDS cannot start, or a setting does not fit the vehicle.
    """

    def __init__(
        self,
        config: BridgeConfig,
        flight: PilotConfig,
        clock: Callable[[], int] = time.time_ns,
        pilot: Pilot | None = None,
    ) -> None:
        self.config, self._flight, self._clock = config, flight, clock
        self.tick_s, self._oldest_s = flight.controller.tick_s, flight.safety.imu_age_s
        self._outputs = Outputs(config, flight.controller.vehicle)
        participant = Participant(config.domain_id)
        self.inputs = Inputs(config, participant, clock)
        self._writers = {topic: participant.writer(topic, name) for topic, name in publications(config).items()}
        self.pilot = pilot or Pilot(flight)
        self.pilot.prepare()
        self._prepared = False  # perception, for pictures of this camera
        self.gate, self._check = Gate(config.check_s), SelfCheck(flight.safety.self_check)
        self._next_alive_ns, self._last_ns, self._commands = 0, -1, 0

    @property
    def status(self) -> BridgeStatus:
        """State after the last tick."""
        flight = self.pilot.status if self.gate.state is BridgeState.FLYING else None
        return BridgeStatus(
            state=self.gate.state,
            reason=self.gate.reason,
            phase=flight.phase if flight else "",
            safety=" ".join((flight.safety, *self.pilot.supervision.supervisor.reasons)) if flight else "",
            commands=self._commands,
            ignored=dict(self.inputs.held.ignored),
        )

    def tick(self, now_ns: int) -> bool:
        """Read, check the gate, step the pilot and send at a monotonic time [ns]; for `ibvs_qp.pilot.runner.run`."""
        self.inputs.poll(now_ns)
        config, before, clock_ns = self.config, self.gate.state, self._clock()
        ages = {role: self.inputs.age_s(role, clock_ns) for role in _INERTIAL}
        limit = config.link_timeout_s
        lost = [role for role, age in ages.items() if age > limit or self.inputs.older(role, now_ns, limit)]
        missing = self._missing(now_ns, lost) if before is not BridgeState.FLYING else []
        if before in (BridgeState.WAITING, BridgeState.CHECKING):  # one late sample does not end a readiness
            missing += [
                f"{role}: {1e3 * age:.0f} ms old, at most {1e3 * self._oldest_s:g} ms"
                for role, age in ages.items()
                if age > self._oldest_s and role not in lost
            ]
        mode = None if self.inputs.older(MODE, now_ns, config.mode_timeout_s) else self.inputs.mode
        state = self.gate.update(now_ns, lost, missing, None if mode is None else mode.engaged)
        if state is BridgeState.FLYING:
            if before is not state:
                self.pilot.reset()
            self._fly()
        if self.gate.state is not BridgeState.FLYING:
            if BridgeState.FLYING in (before, state) or (lost and not self._check.passed):
                self._check.reset()
        if self.gate.state in (BridgeState.READY, BridgeState.FLYING) and now_ns >= self._next_alive_ns:
            self._next_alive_ns = now_ns + round(1e9 / config.alive_hz)
            self._send(self._outputs.alive(self._clock()))
        self._last_ns = now_ns
        return True

    def _fly(self) -> None:
        frame = self.inputs.held.frame(self._clock())
        assert frame is not None and frame.imu_stamp_ns is not None
        command = self.pilot.step(frame)
        if command.safety is SafetyState.TERMINATED:
            self.gate.stop(f"flight ended: {'; '.join(command.safety_reasons)}")
            return
        self._send(self._outputs.setpoints(command, frame.imu_stamp_ns, self._clock()))
        self._commands += 1

    def _send(self, messages: dict[str, Any]) -> None:
        for topic, value in messages.items():
            self._writers[topic].write(value)

    def _missing(self, now_ns: int, lost: list[str]) -> list[str]:
        """Reasons not to be ready, in addition to lost inputs: old sensors, wrong lens, faults in the axes."""
        timeout, held = self.config.sensor_timeout_s, self.inputs.held
        found = [role for role in ("wrench", "color", "depth") if self.inputs.older(role, now_ns, timeout)]
        if not found and self.inputs.older(PAIR, now_ns, timeout):
            found.append("pairs of colour and depth (topics.pair_s)")
        if held.camera is None:
            found.append("camera_info")
        elif not held.camera.has_lens(self._flight.camera.distortion):
            found.append("camera.distortion of the preset is not that of camera_info")
        frame = None if lost else held.frame(self._clock())  # takes the picture as well: it is not kept for the flight
        if frame is not None:
            if frame.image is not None and not self._prepared:
                self.pilot.prepare(frame.image)
                self._prepared = True
            dt = 0.0 if self._last_ns < 0 else (now_ns - self._last_ns) * 1e-9
            rate, force = frame.angular_velocity.tolist(), frame.specific_force.tolist()
            self._check.inertial(frame.attitude.tolist(), rate, force, dt)
        if not self._check.passed:
            found += self._check.faults() or ("rest of the vehicle for the self-check",)
        return found
