"""State machine of the supervisor: faults in, one of six states out, by a table and nothing else."""

from __future__ import annotations

from collections.abc import Mapping

from ibvs_qp.command import SafetyState
from ibvs_qp.supervision.faults import POLICY, Fault, Rule

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
