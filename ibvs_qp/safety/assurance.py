"""Run-time assurance of one flight: monitors, supervisor, and what a state does to references and thrusts.

A complex function (strategy, estimation, program) flies; simple monitors compare its inputs and effects with bounds,
and a state machine replaces its reference, and at last its thrusts, by safe ones (run-time assurance, ASTM F3269).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from allocation import control_effectiveness
from ibvs_qp.command import Command, Outcome, SafetyState
from ibvs_qp.config import SafetySettings
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from ibvs_qp.measurement import Reference
from ibvs_qp.safety.monitors.envelope import EnvelopeMonitor
from ibvs_qp.safety.monitors.persistence import Persistence
from ibvs_qp.safety.monitors.push import PushMonitor
from ibvs_qp.safety.monitors.rotors import RotorMonitor
from ibvs_qp.safety.monitors.samples import SampleMonitor
from ibvs_qp.safety.monitors.wall import WallMonitor
from ibvs_qp.safety.policy import Fault
from ibvs_qp.safety.supervisor import Supervisor
from ibvs_qp.safety.tick import Response, Tick

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
_STILL = np.zeros(2)
_STILL.flags.writeable = False


class Assurance:
    """Watches every tick and supervises the next one.

    Attributes:
        supervisor: The state machine.

    Args:
        vehicle: The vehicle.
        settings: Bounds of the monitors and motions of the states.
    """

    def __init__(self, vehicle: VehicleParams, settings: SafetySettings) -> None:
        self.settings, self._weight, self._tip = settings, vehicle.mass_kg * GRAVITY, vehicle.tip_position_m
        self.supervisor, self._samples = Supervisor(), SampleMonitor(settings)
        self._rotors = RotorMonitor(vehicle, control_effectiveness(vehicle.geometry), settings)
        self._push, self._wall, self._envelope = PushMonitor(settings), WallMonitor(settings), EnvelopeMonitor(settings)
        self._grounded = Persistence(settings.landed_time_s)
        self.reset()

    def reset(self) -> None:
        """As before the flight."""
        for part in (self.supervisor, self._samples, self._rotors, self._push, self._wall, self._envelope):
            part.reset()
        self._grounded.reset()
        self._last: Tick | None = None
        self._first_ns, self._time_s, self._retreat_m = -1, 0.0, self.settings.retreat_m

    @property
    def state(self) -> SafetyState:
        """State of the supervisor, for the next tick."""
        return self.supervisor.state

    @property
    def faults(self) -> Mapping[Fault, str]:
        """Faults of the last tick, with details."""
        return self._last.faults if self._last is not None else {}

    def limits(self, reported: Limits | None) -> Limits | None:
        """Limits of rotors that do not follow, within those that the drive reports; None without either.

        Args:
            reported: Lower and upper thrust limits [N], (n,) each, or None for the configured ones.
        """
        found = self._rotors.limits if self.settings.supervise else None
        if reported is None or found is None:
            return found if reported is None else reported
        lower = np.maximum(reported[0], found[0])
        return lower, np.maximum(np.minimum(reported[1], found[1]), lower)

    def is_news(self, picture: object) -> bool:
        """Whether a picture differs from the last one, if the camera has noise; one that repeats shows nothing."""
        return self._samples.add_picture(picture) or not self.settings.supervise

    def watch(self, tick: Tick, response: Response) -> SafetyState:
        """Compare one tick with all bounds.

        Returns:
            The state, which holds for the next tick.
        """
        if self._first_ns < 0:
            self._first_ns = tick.stamp_ns
        time_s = self._time_s = max((tick.stamp_ns - self._first_ns) * 1e-9, self._time_s)
        self._last = tick
        self._samples.update(tick)
        self._push.update(tick, response, time_s)
        if found := self._rotors.update(
            response.missing_thrust, response.missing_noise, response.motor_thrusts, time_s
        ):
            tick.faults[Fault.ROTOR] = found
        self._envelope.update(tick, time_s)
        self._wall.update(tick, time_s)
        if tick.outcome in _UNSOLVED:
            tick.faults[Fault.SOLVER] = str(tick.outcome)
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
        grounded = before is SafetyState.DESCEND and response.carried_weight > self.settings.landed_ratio * self._weight
        landed = self._grounded.update(grounded, time_s)
        state = self.supervisor.update(time_s, tick.faults, retreated=retreated, landed=landed)
        if state is not before and math.isfinite(distance):  # a vehicle farther away stays there
            self._retreat_m = max(self._retreat_m, distance)
        return state

    def miss(self, tick_s: float) -> SafetyState:
        """Count a tick without a usable input; nothing can be compared with a bound.

        Args:
            tick_s: Nominal control period [s]: the input has no time of its own.

        Returns:
            The state, which holds for the next tick.
        """
        if self._first_ns < 0 or not self.settings.supervise:  # before the first good tick nothing flies
            return self.state
        self._time_s += tick_s
        return self.supervisor.update(self._time_s, {Fault.NO_INPUT: ""})

    def supervised(self, reference: Reference) -> Reference:
        """The reference that the state allows in place of the caller's."""
        state, last = self.state, self._last
        if state is SafetyState.NOMINAL or last is None:
            return reference
        if state is SafetyState.DEGRADED:  # no travel, and no new contact
            pressing = reference.contact and last.contact.in_contact
            stop = reference.standoff if not reference.contact else max(last.contact.distance, LEAST_STOP)
            return dataclasses.replace(reference, velocity=_STILL, travel=_STILL, contact=pressing, standoff=stop)
        down = np.array((0.0, self._descend_speed)) if state is SafetyState.DESCEND else _STILL
        return Reference(standoff=self._retreat_m, velocity=down, tilt=reference.tilt, trim=reference.trim)

    @property
    def _descend_speed(self) -> float:
        """Speed of a descent [m/s]: fast without a hover, because the vehicle turns ever faster."""
        fast = Fault.NO_HOVER in self.faults
        return self.settings.fast_descend_speed_m_s if fast else self.settings.descend_speed_m_s

    def wrench(self, response: Response) -> np.ndarray | None:
        """Contact wrench by inertial data [N, N m], (6,), in place of a faulty sensor's; None while that is good."""
        last = self._last
        if last is None or not (last.faults and self.settings.supervise):
            return None
        if not any(fault in last.faults for fault in _WRENCH):
            return None
        force = -max(response.inertial_push, 0.0) * np.array(last.contact.normal)
        return np.concatenate((force, np.cross(self._tip, force)))

    def thrusts(self, last: np.ndarray | None, floor: np.ndarray) -> np.ndarray | None:
        """Thrusts in place of those of the law [N], (n,); None while the law flies.

        Args:
            last: Thrusts of the tick before, None before the first.
            floor: Lower limits of the vehicle.
        """
        if self.state is SafetyState.TERMINATED:
            return floor
        return last if Fault.NO_ATTITUDE in self.faults and self.settings.supervise else None

    def explained(self, command: Command) -> Command:
        """The command with state and reasons."""
        if self.state is SafetyState.NOMINAL:
            return command
        return dataclasses.replace(command, safety=self.state, safety_reasons=self.supervisor.reasons)
