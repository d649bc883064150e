"""What the supervisor does about every fault: states, delays and recovery, as one table."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from ibvs_qp.command import SafetyState

NOMINAL, DEGRADED, RETREAT, HOVER, DESCEND, TERMINATED = SafetyState


class Fault(StrEnum):
    """Conditions that the monitors detect (`ibvs_qp.safety.monitors`)."""

    INPUTS = "sensor data in other axes"
    WRENCH_STALE = "no force sample"
    WRENCH_FROZEN = "force samples repeat"
    PUSH_UNFELT = "push that the force sensor does not measure"
    PUSH_HIGH = "push above its bound"
    IMAGE_STALE = "no picture"
    IMAGE_FROZEN = "pictures repeat"
    PLANE_STALE = "no wall plane"
    FILTER_REFUSES = "a filter refuses its measurements"
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
        recovery_s: The fault counts as present for this long after its last detection [s].
    """

    stages: tuple[tuple[float, SafetyState], ...]
    recovery_s: float = 0.5

    def state(self, present_s: float) -> SafetyState:
        """State that the fault calls for after a time [s]."""
        due = [state for delay, state in self.stages if present_s >= delay]
        return due[-1] if due else NOMINAL


def _rule(*stages: tuple[float, SafetyState], recovery_s: float = 0.5) -> Rule:
    return Rule(stages, recovery_s)


#: Blind to the wall's lines: stop, hold the contact for half a second, retreat, hover on inertial data, and descend
#: before their drift reaches the wall.
_BLIND = _rule((0.0, DEGRADED), (0.5, RETREAT), (6.0, HOVER), (8.0, DESCEND))
#: Attitude by motors' model and camera: away from the wall, and down before the lines leave the picture.
_UNSTEADY = _rule((0.0, DEGRADED), (0.2, RETREAT), (3.0, DESCEND))
#: At once, because every further tick presses.
_AT_ONCE = _rule((0.0, RETREAT))

#: The reaction to every fault. From RETREAT on a state is never left for a milder one.
POLICY: dict[Fault, Rule] = {
    Fault.INPUTS: _rule((0.0, DEGRADED), (0.1, RETREAT)),
    Fault.WRENCH_STALE: _rule((0.02, DEGRADED), (0.1, RETREAT)),
    Fault.WRENCH_FROZEN: _AT_ONCE,
    Fault.PUSH_UNFELT: _AT_ONCE,
    Fault.PUSH_HIGH: _AT_ONCE,
    Fault.IMAGE_STALE: _BLIND,
    Fault.IMAGE_FROZEN: _BLIND,
    Fault.PLANE_STALE: _BLIND,
    Fault.FILTER_REFUSES: _rule((0.0, DEGRADED), (2.0, RETREAT)),
    Fault.NO_ATTITUDE: _rule((0.0, DEGRADED), (0.2, TERMINATED), recovery_s=0.0),
    Fault.IMU_STALE: _UNSTEADY,
    Fault.IMU_FROZEN: _UNSTEADY,
    Fault.ROTOR: _AT_ONCE,
    Fault.NO_HOVER: _rule((0.0, DESCEND)),
    Fault.SOLVER: _rule((0.0, DEGRADED), (0.3, RETREAT)),
    Fault.TILT: _AT_ONCE,
    Fault.FLIP: _rule((0.2, TERMINATED)),
    Fault.RATE: _AT_ONCE,
    Fault.SPEED: _AT_ONCE,
    Fault.HEIGHT: _rule((0.0, HOVER)),
    Fault.WALL_GONE: _AT_ONCE,
    Fault.CONTACT_LOST: _AT_ONCE,
    Fault.MISSION_TIME: _AT_ONCE,
}
