"""Faults, and the reaction to each as one table: states, delays and recovery."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from ibvs_qp.command import SafetyState

NOMINAL, DEGRADED, RETREAT, HOVER, DESCEND, TERMINATED = SafetyState


class Fault(StrEnum):
    """Conditions that the monitors detect (`ibvs_qp.supervision.monitors`)."""

    INPUTS = "sensor data in other axes"
    WRENCH_STALE = "no force sample"
    WRENCH_FROZEN = "force samples repeat"
    PUSH_UNFELT = "push that the force sensor does not measure"
    PUSH_HIGH = "push above its bound"
    IMAGE_STALE = "no picture"
    IMAGE_FROZEN = "pictures repeat"
    PLANE_STALE = "no wall plane"
    LINES_STALE = "no line in sight"
    FILTER_REFUSES = "a filter refuses its measurements"
    NO_INPUT = "no usable input"
    NO_ATTITUDE = "no attitude, measured or estimated"
    IMU_STALE = "no inertial sample"
    IMU_FROZEN = "inertial samples repeat"
    ROTOR = "a rotor does not follow"
    NO_HOVER = "no level hover within the thrust limits"
    SOLVER = "no solver finds a solution"
    TILT = "tilt"
    FLIP = "flipped"
    RATE = "angular rate"
    SPEED = "speed"
    HEIGHT = "height left the envelope"
    WALL_GONE = "no contact where the wall was"
    CONTACT_LOST = "contact lost"
    MISSION_TIME = "mission time"


@dataclass(frozen=True)
class Rule:
    """Reaction to one fault.

    Attributes:
        stages: Pairs of time since the fault began [s] and state from then on, in the order of time.
        bounds: Settings that detect it (`ibvs_qp.config.SafetySettings`), in addition to those of other parts.
        recovery_s: The fault counts as present for this long after its last detection [s].
    """

    stages: tuple[tuple[float, SafetyState], ...]
    bounds: tuple[str, ...] = ()
    recovery_s: float = 0.5

    def state(self, present_s: float) -> SafetyState:
        """State that the fault calls for after a time [s]."""
        due = [state for delay, state in self.stages if present_s >= delay]
        return due[-1] if due else NOMINAL


_Stage = tuple[float, SafetyState]
#: At once, because every further tick presses.
_AT_ONCE: tuple[_Stage, ...] = ((0.0, RETREAT),)
#: Blind to the wall's lines: stop, hold the contact for half a second, retreat, hover on inertial data, and descend
#: before their drift reaches the wall.
_BLIND: tuple[_Stage, ...] = ((0.0, DEGRADED), (0.5, RETREAT), (3.0, HOVER), (4.0, DESCEND))
#: Attitude by motors' model and camera: away from the wall, and down before the lines leave the picture.
_UNSTEADY: tuple[_Stage, ...] = ((0.0, DEGRADED), (0.2, RETREAT), (3.0, DESCEND))

#: The reaction to every fault. From RETREAT on a state is never left for a milder one.
POLICY: dict[Fault, Rule] = {
    Fault.INPUTS: Rule(((0.0, DEGRADED), (0.1, RETREAT)), ("self_check",)),
    Fault.WRENCH_STALE: Rule(((0.02, DEGRADED), (0.1, RETREAT)), ("wrench_age_s",)),
    Fault.WRENCH_FROZEN: Rule(_AT_ONCE, ("frozen_samples",)),
    Fault.PUSH_UNFELT: Rule(_AT_ONCE, ("unfelt_push_n", "unfelt_ratio", "push_time_s")),
    Fault.PUSH_HIGH: Rule(_AT_ONCE, ("push_ratio", "push_floor_n", "push_time_s")),
    # A late picture now and then is no blindness.
    Fault.IMAGE_STALE: Rule(_BLIND, ("image_age_s", "first_picture_s"), recovery_s=0.15),
    Fault.IMAGE_FROZEN: Rule(_BLIND, ("frozen_pictures",)),
    Fault.PLANE_STALE: Rule(_BLIND, ("plane_age_s", "first_picture_s")),
    Fault.LINES_STALE: Rule(((0.0, DEGRADED), (3.0, RETREAT)), ("lines_age_s",)),
    Fault.FILTER_REFUSES: Rule(((0.0, DEGRADED), (2.0, RETREAT)), ("refusal_s",)),
    # Hover by the last attitude meanwhile; a clock that jumps is followed after a tenth of a second.
    Fault.NO_INPUT: Rule(((0.2, DEGRADED), (0.5, TERMINATED)), recovery_s=0.0),
    Fault.NO_ATTITUDE: Rule(((0.0, DEGRADED), (0.2, TERMINATED)), recovery_s=0.0),
    Fault.IMU_STALE: Rule(_UNSTEADY, ("imu_age_s",)),
    Fault.IMU_FROZEN: Rule(_UNSTEADY, ("frozen_imu_samples",)),
    Fault.ROTOR: Rule(_AT_ONCE, ("missing_thrust_n", "missing_sigmas", "missing_time_s")),
    Fault.NO_HOVER: Rule(((0.0, DESCEND),)),
    Fault.SOLVER: Rule(((0.0, DEGRADED), (0.3, RETREAT))),
    Fault.TILT: Rule(_AT_ONCE, ("tilt_deg", "envelope_time_s")),
    Fault.FLIP: Rule(((0.2, TERMINATED),), ("flip_deg", "envelope_time_s")),
    Fault.RATE: Rule(_AT_ONCE, ("rate_rad_s", "envelope_time_s")),
    Fault.SPEED: Rule(_AT_ONCE, ("speed_m_s", "envelope_time_s")),
    Fault.HEIGHT: Rule(((0.0, HOVER),), ("height_m", "envelope_time_s")),
    Fault.WALL_GONE: Rule(_AT_ONCE, ("wall_gone_m", "envelope_time_s")),
    Fault.CONTACT_LOST: Rule(_AT_ONCE, ("contact_lost_s",)),
    Fault.MISSION_TIME: Rule(_AT_ONCE, ("mission_s",)),
}
