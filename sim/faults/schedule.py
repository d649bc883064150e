"""When the faults of a flight begin and end."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from sim.faults.fault import Fault, FrameFilter, SensorFault, Surroundings
from sim.world.random_streams import stream


class FaultSchedule:
    """Applies each fault once, at its time, and ends it after its duration.

    Attributes:
        struck: Faults that have begun: index and time [s].

    Args:
        faults: The faults; those of sensors act in this order.
        seed: Seed of the flight; every fault has its own random numbers.
    """

    def __init__(self, faults: Sequence[Fault], seed: int = 0) -> None:
        self.faults, self._seed = tuple(faults), seed
        self.struck: dict[int, float] = {}
        self._begun: dict[str, float] = {}
        self._added: dict[int, float] = {}  # times from which the delays of later faults count [s]
        self._filters: dict[int, FrameFilter] = {}
        self._present: set[int] = set()
        self._now = 0.0
        self._waiting: SensorFrame | None = None

    def add(self, now_s: float, *faults: Fault) -> None:
        """Further faults in flight, whose delays begin now [s]."""
        self._added.update(dict.fromkeys(range(len(self.faults), len(self.faults) + len(faults)), now_s))
        self.faults += faults

    @property
    def watching(self) -> bool:
        """Whether a fault demands that the flight goes on."""
        return any(self._now < begun + self.faults[index].watch_s for index, begun in self.struck.items())

    def tick(self, world: Surroundings, pilot: Pilot) -> list[str]:
        """Begin and end the faults that are due; returns descriptions of those that begin."""
        if not self.faults:
            return []
        now = self._now = world.plant.time_ns * 1e-9
        self._begun.setdefault("start", now)
        self._begun.setdefault(pilot.painter.phase, now)
        if pilot.setpoints.contact.in_contact:
            self._begun.setdefault("touch", now)
        happened = []
        for index, fault in enumerate(self.faults):
            begun = self._added.get(index, self._begun.get(fault.after, math.inf))
            if index not in self.struck and now >= begun + fault.delay_s:
                self.struck[index] = now
                self._present.add(index)
                if isinstance(fault, SensorFault):
                    self._filters[index] = fault.filter(stream(self._seed, f"fault {index}"))
                happened.append(fault.strike(world, pilot))
            elif index in self._present and now >= self.struck[index] + (fault.duration_s or math.inf):
                self._present.remove(index)
                self._filters.pop(index, None)
                fault.end(world, pilot)
        return happened

    def seen(self, frame: SensorFrame) -> SensorFrame | None:
        """Input of the pilot for a sensor frame; None: this tick of the pilot does not take place.

        The newest picture of the ticks that are left out waits in the camera's driver.
        """
        given: SensorFrame | None = frame
        for index in sorted(self._filters):
            if given is not None:
                given = self._filters[index](given)
        if given is None:
            self._waiting = frame if frame.features is not None or frame.image is not None else self._waiting
            return None
        late, self._waiting = self._waiting, None
        if late is None or given.features is not None or given.image is not None:
            return given
        return dataclasses.replace(given, features=late.features, image=late.image)
