"""Push of a flight: asked by the strategy, commanded by the law, felt at the wall, and why it is reduced."""

from __future__ import annotations

from ibvs_qp.command import Command
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.measurement import Reference
from ibvs_qp.model.setpoints import Setpoints

#: Kinds of events in the log of the strategy.
REDUCED, RESTORED = "push reduced", "push restored"
#: A push below this part of the asked one is reduced; a higher one than this is restored [-].
REDUCED_PART, RESTORED_PART = 0.95, 0.97
#: Averaging time of the felt push [s]: a start of a stroke lacks a tenth of the push for a second.
FELT_TIME_S = 3.0
#: Time for which a new reason must hold [s].
SETTLED_S = 0.5
#: Name of the rows of thrust limits before the name of their rotor.
_THRUST = "thrust_"


class PushReport:
    """Watches the push of every tick, and names every change of the reason for which it is reduced.

    Attributes:
        asked_n: Push of the strategy's target [N]; 0 while it does not press.
        commanded_n: Push that the law commands after reach check and ramp [N].
        felt_n: Filtered push on the wall [N]; 0 out of contact.
        reduction: Why the push is below the asked one, with numbers; empty while it is not.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """As before the flight."""
        self.asked_n = self.commanded_n = self.felt_n = 0.0
        self.reduction = ""
        self._lacking = 0.0  # mean of commanded minus felt push [N], since the ramp ended
        self._cause, self._next, self._held = "", "", 0.0

    def update(
        self, reference: Reference, contact: ContactState, setpoints: Setpoints, command: Command, dt: float
    ) -> tuple[str, str] | None:
        """Add a tick.

        Args:
            reference: Reference of the law.
            contact: Contact of the tick.
            setpoints: Set-points of the law.
            command: Its command.
            dt: Time since the last tick [s].

        Returns:
            Kind and text of an event when the reason has changed, None otherwise.
        """
        pressing = reference.contact and reference.push_force > 0.0
        self.asked_n = reference.push_force if pressing else 0.0
        self.commanded_n = setpoints.push_reference * contact.ramp if pressing else 0.0
        self.felt_n = contact.push if contact.in_contact else 0.0
        if not pressing:
            self._lacking = self._held = 0.0
            return None
        lacking, part = self.commanded_n - contact.push, min(1.0, dt / FELT_TIME_S)
        ramped = contact.in_contact and contact.ramp >= 1.0
        self._lacking = self._lacking + part * (lacking - self._lacking) if ramped else 0.0
        cause = self._found(setpoints)
        self._held = self._held + dt if cause == self._next and cause != self._cause else 0.0
        self._next = cause
        if self._held < SETTLED_S:
            return None
        self._cause, self._held = cause, 0.0
        self.reduction = self._words(cause, setpoints, command)
        if not cause:
            return RESTORED, f"{setpoints.push_reference:.1f} N of {self.asked_n:.1f} N asked"
        return REDUCED, self.reduction

    def _found(self, setpoints: Setpoints) -> str:
        """Cause of a reduced push; empty without one. Its numbers are in the words, so that noise changes nothing."""
        part = RESTORED_PART if self._cause else REDUCED_PART
        if setpoints.least_push > setpoints.reach:
            return "unattainable"
        if setpoints.push_reference < part * self.asked_n:
            return f"reach, {_friction(setpoints)[0]}, {setpoints.derated}"
        return "felt" if self._lacking > 0.0 and self._felt() < part * self.asked_n else ""

    def _felt(self) -> float:
        """Felt push without its noise [N]."""
        return self.commanded_n - self._lacking

    def _words(self, cause: str, setpoints: Setpoints, command: Command) -> str:
        asked, (_, friction) = f"{self.asked_n:.1f} N asked", _friction(setpoints)
        if not cause:
            return ""
        if cause == "unattainable":
            return f"none of {asked}: the rotors cannot hold any push level, {friction}"
        if cause == "felt":
            active = ", ".join(limit.name for limit in command.active_limits if limit.name.startswith(_THRUST))
            return f"{self._felt():.1f} N felt of {asked}: {active or 'no thrust limit'} active"
        rotors = " and ".join(
            f"{name} at its {side} limit of {n:.1f} N" for name, side, n in setpoints.limiting_rotors()
        )
        derated = " (lowered)" if setpoints.derated else ""
        return (
            f"reach {setpoints.push_reference:.1f} N of {asked}: {friction}, {rotors or 'no rotor at a limit'}{derated}"
        )


def _friction(setpoints: Setpoints) -> tuple[str, str]:
    """Kind of the friction in the reach, and the same in words with its value."""
    if setpoints.reach_friction <= 0.0:
        return "standing", "standing still"
    kind = "measured" if setpoints.friction_measured else "assumed"
    return kind, f"friction {setpoints.reach_friction:.2f} {kind}"
