"""Contact that ends where it should not: the wall moved away, or the tip does not find it again."""

from __future__ import annotations

from ibvs_qp.config import SafetySettings
from ibvs_qp.safety.monitors.persistence import Persistence
from ibvs_qp.safety.policy import Fault
from ibvs_qp.safety.tick import Tick


class WallMonitor:
    """Watches a contact from its first touch until the press is released."""

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self._gone, self._lost = Persistence(settings.envelope_time_s), Persistence(settings.contact_lost_s)
        self.reset()

    def reset(self) -> None:
        """As before the first touch."""
        self._touched = False
        self._gone.reset()
        self._lost.reset()

    def update(self, tick: Tick, time_s: float) -> None:
        """Add a contact that ended although the reference presses."""
        contact, faults = tick.contact, tick.faults
        self._touched = tick.press and (self._touched or contact.in_contact)
        free = self._touched and not contact.in_contact
        if self._gone.update(free and contact.distance > self._settings.wall_gone_m, time_s):
            faults[Fault.WALL_GONE] = f"{1e3 * min(contact.distance, 10.0):.0f} mm from the tip"
        if self._lost.update(free, time_s):
            faults[Fault.CONTACT_LOST] = f"for {self._settings.contact_lost_s:g} s"
