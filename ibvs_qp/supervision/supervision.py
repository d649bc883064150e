"""Supervision of one flight: effect of monitors and state machine on reference, limits, contact wrench and thrusts.

A complex function (strategy, estimation, program) has control; simple monitors compare its inputs and effects with
bounds, and a state machine replaces its reference, and at last its thrusts, by safe ones (run-time assurance, ASTM
F3269).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from allocation import control_effectiveness
from ibvs_qp.command import Command, Outcome, SafetyState
from ibvs_qp.config import ControllerConfig, SafetySettings
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.frames import GRAVITY
from ibvs_qp.measurement import Reference
from ibvs_qp.model.reporting import fixed_command
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.supervision.faults import POLICY, Fault, Rule
from ibvs_qp.supervision.monitors import (
    EnvelopeMonitor,
    Persistence,
    PushMonitor,
    SampleMonitor,
    Tick,
    WallMonitor,
)
from ibvs_qp.supervision.rotor_monitor import RotorLoss, RotorMonitor
from ibvs_qp.validation.load_check import LoadCheck
from ibvs_qp.validation.self_check import SelfCheck

_SEVERITY = {state: index for index, state in enumerate(SafetyState)}


class Supervisor:
    """Combines the faults present into a state.

    - Every fault calls for the state of its rule by the time from its first to its last detection; the most severe
      counts.
    - A fault counts as present until it was absent for its recovery time, which does not count as time present.
    - DEGRADED ends with its faults. From RETREAT on a state only becomes more severe; TERMINATED is final.
    - A retreat that has reached its distance is a HOVER; a descent that has landed is TERMINATED.

    Attributes:
        state: The present state.
        reasons: Faults that called for it, with their details; empty while nominal.

    Args:
        policy: Rules of the faults.
    """

    CONSTANTS = ("_policy",)

    def __init__(self, policy: Mapping[Fault, Rule] = POLICY) -> None:
        self._policy = policy
        self.reset()

    def reset(self) -> None:
        """As before the flight."""
        self.state, self.reasons = SafetyState.NOMINAL, ()
        self._since: dict[Fault, float] = {}  # when each fault present began
        self._seen: dict[Fault, float] = {}  # when each was detected last
        self._details: dict[Fault, str] = {}

    def update(
        self, time_s: float, faults: Mapping[Fault, str], *, retreated: bool = False, landed: bool = False
    ) -> SafetyState:
        """State at one tick.

        Args:
            time_s: Time that never decreases [s].
            faults: Faults detected at this tick, with details for the log.
            retreated: Whether the vehicle has reached the distance of a retreat.
            landed: Whether it stands on the ground.

        Returns:
            The state.
        """
        if not faults and not self._since and self.state is SafetyState.NOMINAL:
            return self.state
        self._refresh(time_s, faults)
        demands = {
            fault: self._policy[fault].state(max(self._seen[fault] - since, 0.0))
            for fault, since in self._since.items()
        }
        demanded = max(demands.values(), key=_SEVERITY.__getitem__, default=SafetyState.NOMINAL)
        if _SEVERITY[demanded] > _SEVERITY[self.state] or self.state is SafetyState.DEGRADED:
            self.reasons = tuple(self._text(fault) for fault, state in demands.items() if state is demanded)
            self.state = demanded
        if self.state is SafetyState.NOMINAL:
            self.reasons = ()
        if self.state is SafetyState.RETREAT and retreated:
            self.state, self.reasons = SafetyState.HOVER, (*self.reasons, "retreated")
        if self.state is SafetyState.DESCEND and landed:
            self.state, self.reasons = SafetyState.TERMINATED, (*self.reasons, "landed")
        return self.state

    def _refresh(self, time_s: float, faults: Mapping[Fault, str]) -> None:
        """Begin, prolong and end the faults."""
        for fault, detail in faults.items():
            self._since.setdefault(fault, time_s)
            self._seen[fault], self._details[fault] = time_s, detail
        for fault in [each for each in self._since if each not in faults]:
            if time_s - self._seen[fault] >= self._policy[fault].recovery_s:
                del self._since[fault]

    def _text(self, fault: Fault) -> str:
        detail = self._details[fault]
        return f"{fault}: {detail}" if detail else str(fault)


#: Faults of the force sensor, and of the camera.
_WRENCH = (Fault.WRENCH_STALE, Fault.WRENCH_FROZEN, Fault.PUSH_UNFELT)
_BLIND = (Fault.IMAGE_STALE, Fault.IMAGE_FROZEN, Fault.PLANE_STALE)
#: Faults after which the vehicle moves by tilting, less precisely.
_TILTING = (Fault.ROTOR, Fault.NO_HOVER)
#: Outcomes without a solution of the program.
_UNSOLVED = (Outcome.ANALYTIC_FALLBACK, Outcome.HOLD)
#: A retreat has ended this far before its distance [m].
RETREAT_REACHED = 0.03
#: Least distance at which a degraded vehicle that shall not touch the wall stops [m].
LEAST_STOP = 0.05
#: Lower and upper thrust limits [N], (n,) each.
Limits = tuple[np.ndarray, np.ndarray]
#: Contact wrench [N, N m], (6,), and its stamp.
WrenchSample = tuple[np.ndarray, int]
_STILL = np.zeros(2)
_STILL.flags.writeable = False


class Supervision:
    """Watches every tick and supervises the next one; `Pilot` and `Assured` pass it their data.

    Attributes:
        settings: Bounds of the monitors and motions of the states.
        supervisor: The state machine.
        rotor_loss: Flight without a level hover.
        self_check: Start-up check of the sensors' axes.

    Args:
        config: Vehicle and gains.
        settings: Bounds and motions; None takes the defaults.
        load: Check of the force sensor by the tool's load, for raw readings; None for a tared wrench.
    """

    def __init__(
        self, config: ControllerConfig, settings: SafetySettings | None = None, load: LoadCheck | None = None
    ) -> None:
        self.settings = settings = settings or SafetySettings()
        vehicle = config.vehicle
        self._tick_s, self._weight, self._tip = config.tick_s, vehicle.mass_kg * GRAVITY, vehicle.tip_position_m
        self._box, self._most_change = (vehicle.thrust_min, vehicle.thrust_max), vehicle.thrust_rate_n_s * config.tick_s
        self.supervisor, self.self_check = Supervisor(), SelfCheck(settings.self_check, load)
        self.rotor_loss = RotorLoss(vehicle, config.gains)
        self._rotors = RotorMonitor(vehicle, control_effectiveness(vehicle.geometry), settings)
        self._samples, self._push = SampleMonitor(settings), PushMonitor(settings)
        self._wall, self._envelope = WallMonitor(settings), EnvelopeMonitor(settings)
        self._grounded = Persistence(settings.landed_time_s)
        self.reset()

    def reset(self) -> None:
        """As before the flight."""
        monitors = (self._samples, self._rotors, self._push, self._wall, self._envelope, self._grounded)
        for part in (self.supervisor, self.self_check, self.rotor_loss, *monitors):
            part.reset()
        self._last: Tick | None = None
        self._thrusts: np.ndarray | None = None  # of the last command
        self._first_ns = self._imu_ns = -1
        self._time_s, self._retreat_m = 0.0, self.settings.retreat_m

    @property
    def state(self) -> SafetyState:
        """State of the supervisor, for the next tick."""
        return self.supervisor.state

    @property
    def faults(self) -> Mapping[Fault, str]:
        """Faults of the last tick, with details."""
        return self._last.faults if self._last is not None else {}

    # ------------------------------------------------------------------ inputs

    def is_new_picture(self, picture: object) -> bool:
        """Whether a picture differs from the last one, if the camera has noise; one that repeats shows nothing."""
        return self._samples.add_picture(picture) or not self.settings.supervise

    def imu_stamp(self, sampled: bool, stamp_ns: int, *stamps: int | None) -> int:
        """Stamp of the oldest inertial sample, -1 before the first; ``sampled``: whether this tick has all of them.

        ``stamps`` are those of attitude and inertial unit, None for at the tick.
        """
        if sampled:
            self._imu_ns = min([stamp_ns, *(stamp for stamp in stamps if stamp is not None)])
        return self._imu_ns

    def check_axes(
        self,
        inertial: tuple[Sequence[float], Sequence[float], Sequence[float]] | None,
        force: Sequence[float] | None,
        contact: ContactState,
        dt: float,
    ) -> tuple[str, ...]:
        """Self-check with the sensors of the tick; the findings, for `Command.rejected`.

        ``inertial`` are attitude, gyro and accelerometer as measured, ``force`` is that of the vehicle on the tool [N].
        """
        if inertial is not None:
            self.self_check.inertial(*inertial, dt)
        if force is not None:
            self.self_check.contact(force, contact.push_noise, contact.normal, contact.distance, dt)
        return tuple([f"self-check: {fault}" for fault in self.self_check.faults()])

    def contact_wrench(self, sample: WrenchSample, now_ns: int, turned: bool, setpoints: Setpoints) -> WrenchSample:
        """Contact wrench: by inertial data while the force sensor is faulty.

        It is zero for a vehicle that has turned from the wall: its sensor measures the tool that swings round.
        """
        return self.replaced_wrench(sample[1], now_ns, turned, setpoints) or sample

    def replaced_wrench(self, sample_ns: int, now_ns: int, turned: bool, setpoints: Setpoints) -> WrenchSample | None:
        """Wrench in place of a sample of that time; None while the sample counts."""
        wrench, last = None, self._last
        if last is not None and last.faults and self.settings.supervise:
            if any(fault in last.faults for fault in _WRENCH):
                force = -max(setpoints.inertial_push, 0.0) * np.array(last.contact.normal)
                wrench, sample_ns = np.concatenate((force, np.cross(self._tip, force))), now_ns
        if turned:
            wrench = np.zeros(6)
        return None if wrench is None else (wrench, sample_ns)

    # --------------------------------------------------------------- decisions

    def limits(self, reported: Limits | None) -> Limits | None:
        """Limits of rotors that do not follow, within those that the drive reports; None without either.

        Args:
            reported: Lower and upper thrust limits [N], (n,) each, or None for the configured ones.
        """
        if not self.settings.supervise:
            return reported
        found, scale = self._rotors.limits, self._rotors.scale
        if scale.min() < 1.0:
            lower, upper = self._box if reported is None else reported
            reported = scale * lower, scale * upper
        if reported is None or found is None:
            return found if reported is None else reported
        lower = np.maximum(reported[0], found[0])
        return lower, np.maximum(np.minimum(reported[1], found[1]), lower)

    @property
    def rotor_note(self) -> str:
        """Last change of a rotor's scale in words; empty before the first."""
        return self._rotors.note

    def _scaled(self, command: Command) -> Command:
        """The command for weak rotors: more than the thrust that they are to give, within limits and thrust rate."""
        thrusts, last = command.thrusts, self._thrusts
        if self.rotor_note and self.settings.supervise and last is not None:
            if self.state is not SafetyState.TERMINATED:
                thrusts = np.clip(thrusts / self._rotors.scale, *self._box)
            thrusts = np.clip(thrusts, last - self._most_change, last + self._most_change)
            command = dataclasses.replace(command, thrusts=thrusts)
        self._thrusts = thrusts.copy()  # those of the command are the caller's
        return command

    def reference(self, requested: Reference) -> Reference:
        """The reference that the state allows in place of the caller's."""
        state, last = self.state, self._last
        if state is SafetyState.NOMINAL or last is None:
            return requested
        if state is SafetyState.DEGRADED:  # no travel, and no new contact
            pressing = requested.contact and last.contact.in_contact
            stop = requested.standoff if not requested.contact else max(last.contact.distance, LEAST_STOP)
            return dataclasses.replace(requested, velocity=_STILL, travel=_STILL, contact=pressing, standoff=stop)
        down = np.array((0.0, self._descend_speed)) if state is SafetyState.DESCEND else _STILL
        return Reference(standoff=self._retreat_m, velocity=down, tilt=requested.tilt, trim=requested.trim)

    @property
    def _descend_speed(self) -> float:
        """Speed of a descent [m/s]: fast without a hover, because the vehicle turns ever faster."""
        fast = Fault.NO_HOVER in self.faults
        return self.settings.fast_descend_speed_m_s if fast else self.settings.descend_speed_m_s

    def thrusts(self, setpoints: Setpoints) -> np.ndarray | None:
        """Thrusts in place of those of the law [N], (n,); None while the law has control."""
        if self.state is SafetyState.TERMINATED:
            return setpoints.floor
        return setpoints.last if Fault.NO_ATTITUDE in self.faults and self.settings.supervise else None

    def command(
        self, law: Callable[[], Command], setpoints: Setpoints, stamp_ns: int, rejected: tuple[str, ...] = ()
    ) -> tuple[Command, np.ndarray | None]:
        """Command of the law, or of the supervisor where it replaces the law; and the supervisor's thrusts then."""
        fixed = self.thrusts(setpoints)
        if fixed is not None:
            return fixed_command(setpoints, stamp_ns, fixed, rejected), fixed
        return law(), None

    def explained(self, command: Command) -> Command:
        """The command as the motors get it: for weak rotors, with state and reasons."""
        command = self._scaled(command)
        if self.state is SafetyState.NOMINAL:
            return command
        return dataclasses.replace(command, safety=self.state, safety_reasons=self.supervisor.reasons)

    # -------------------------------------------------------------- monitoring

    def watch(self, tick: Tick, setpoints: Setpoints) -> SafetyState:
        """Compare one tick with all bounds.

        Returns:
            The state, which holds for the next tick.
        """
        if self._first_ns < 0:
            self._first_ns = tick.stamp_ns
        time_s = self._time_s = max((tick.stamp_ns - self._first_ns) * 1e-9, self._time_s)
        self._last = tick
        self._detect(tick, setpoints, time_s)
        if not self.settings.supervise:
            return self.state
        before, distance = self.state, tick.contact.distance
        if before is SafetyState.NOMINAL and not tick.faults:
            return self.supervisor.update(time_s, tick.faults)
        if any(fault in tick.faults for fault in _BLIND):
            self._retreat_m = max(self._retreat_m, self.settings.blind_retreat_m)
        if any(fault in tick.faults for fault in _TILTING):
            self._retreat_m = max(self._retreat_m, self.settings.tilting_retreat_m)
        retreated = distance > self._retreat_m - RETREAT_REACHED and not tick.contact.in_contact
        carried = setpoints.carried_weight > self.settings.landed_ratio * self._weight
        landed = self._grounded.update(before is SafetyState.DESCEND and carried, time_s)
        state = self.supervisor.update(time_s, tick.faults, retreated=retreated, landed=landed)
        if state is not before and math.isfinite(distance):  # a vehicle farther away stays there
            self._retreat_m = max(self._retreat_m, distance)
        return state

    def _detect(self, tick: Tick, setpoints: Setpoints, time_s: float) -> None:
        """Add all faults to those that the caller found."""
        if self.rotor_loss.lost:
            tick.faults[Fault.NO_HOVER] = ""
        if found := self.self_check.faults():
            tick.faults[Fault.INPUTS] = "; ".join(found)
        self._samples.update(tick)
        self._push.update(tick, setpoints, time_s)
        if found := self._rotors.update(
            setpoints.missing_thrust, setpoints.missing_noise, setpoints.motor_thrusts, time_s
        ):
            tick.faults[Fault.ROTOR] = found
        self._envelope.update(tick, time_s)
        self._wall.update(tick, time_s)
        if tick.outcome in _UNSOLVED:
            tick.faults[Fault.SOLVER] = str(tick.outcome)

    def miss(self) -> SafetyState:
        """Count a tick without a usable input, which has no time of its own; nothing can be compared with a bound.

        Returns:
            The state, which holds for the next tick.
        """
        if self._first_ns < 0 or not self.settings.supervise:  # before the first good tick nothing is controlled
            return self.state
        self._time_s += self._tick_s
        return self.supervisor.update(self._time_s, {Fault.NO_INPUT: ""})
