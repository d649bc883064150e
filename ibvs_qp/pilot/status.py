"""Progress of a flight, for callers of a `Pilot`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from ibvs_qp.command import SafetyState


class Event(NamedTuple):
    """A change of phase, or something that the strategy met."""

    time_s: float  # since the first tick [s]
    name: str  # phase or event
    reason: str


@dataclass(frozen=True, kw_only=True)
class FlightStatus:
    """State of a flight after the last tick.

    Attributes:
        phase: Phase of the strategy, one of `ibvs_qp.pilot.painting.strategy.PHASES`.
        finished: Whether the flight has ended: nothing more happens, the vehicle may be taken over.
        failed: Whether the job was not, or will not be, completed.
        reason: Why it ended or failed; empty until then.
        safety: State of the supervisor.
        events: Phases and events so far, oldest first.
        push_asked_n: Push of the strategy's target [N]; 0 while it does not press.
        push_commanded_n: Push that the law commands after reach check and ramp [N].
        push_flown_n: Filtered push on the wall [N]; 0 out of contact.
        push_reduction: Why the push is below the asked one, with numbers; empty while it is not.
    """

    phase: str
    finished: bool
    failed: bool
    reason: str
    safety: SafetyState
    events: tuple[Event, ...]
    push_asked_n: float = 0.0
    push_commanded_n: float = 0.0
    push_flown_n: float = 0.0
    push_reduction: str = ""
