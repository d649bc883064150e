"""A fault: when it begins and ends, and where it acts."""

from __future__ import annotations

import dataclasses
import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ibvs_qp.config.settings import Checked, setting
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from sim.world.canvas import Canvas
from sim.world.plant import Plant

#: Input of the pilot instead of a sensor frame; None: this tick of the pilot does not take place.
FrameFilter = Callable[[SensorFrame], SensorFrame | None]


class Surroundings(Protocol):
    """The part of the world that faults change."""

    plant: Plant
    canvas: Canvas


@dataclass(frozen=True, kw_only=True)
class Fault(Checked, ABC):
    """A fault that occurs once."""

    after: str = setting("touch", 'event that starts the delay: "start", "touch", or a phase of the strategy')
    delay_s: float = setting(3.0, "time from then on", unit="s", low=0.0, high=600.0)
    duration_s: float | None = setting(None, "until the fault ends; permanent without", unit="s", low=1e-3, high=600.0)
    watch_s: float = setting(0.0, "the flight goes on at least this long after it", unit="s", low=0.0, high=600.0)

    @abstractmethod
    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Apply the fault; returns its description."""

    def end(self, world: Surroundings, pilot: Pilot) -> None:
        """Undo the fault after its duration."""

    @property
    def words(self) -> str:
        """Name of the kind in words, with the settings of its own."""
        own = [field.name for field in dataclasses.fields(self) if field.name not in _TIMING]
        values = ", ".join(f"{name} {getattr(self, name)}" for name in own if getattr(self, name) not in (None, ""))
        kind = re.sub(r"(?<!^)([A-Z])", r" \1", type(self).__name__).lower()
        return f"{kind}: {values}" if values else kind


_TIMING = {field.name for field in dataclasses.fields(Fault)}


@dataclass(frozen=True, kw_only=True)
class NoFault(Fault):
    """Nothing happens: for false alarms."""

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Nothing changes."""
        return self.words


@dataclass(frozen=True, kw_only=True)
class SensorFault(Fault):
    """A fault of the inputs of the pilot: sensors, time stamps, or the tick itself."""

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Nothing else changes."""
        return self.words

    @abstractmethod
    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """A function of every sensor frame from now on, with the memory of one flight.

        Args:
            rng: Random numbers of this fault.
        """
