"""States of the bridge: waiting, checking, ready, flying, stopped."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum


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
