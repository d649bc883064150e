"""A fault: when it begins and ends, and where it acts."""

from __future__ import annotations

import copy
import dataclasses
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ibvs_qp.config.settings import Checked, choice, setting
from ibvs_qp.measurement import SensorFrame, channels
from ibvs_qp.pilot import Pilot
from ibvs_qp.validation.fields import SENSOR_FRAME
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


@dataclass(frozen=True, kw_only=True)
class ChannelFault(SensorFault):
    """One channel of the sensor frame fails."""

    channel: str = choice("wrench", "which one", tuple([row.name for row in SENSOR_FRAME.rows]))
    how: str = choice(
        "nan",
        "no numbers, or the sample of then again and again, with fresh stamps or its own",
        ("nan", "stuck", "lost"),
    )

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """NaN, or repeat the first frame's."""
        names = (self.channel,)
        return not_numbers(names) if self.how == "nan" else repeated(names, stamps=self.how == "lost")


def repeated(names: Sequence[str], *, stamps: bool) -> FrameFilter:
    """Repeats channels of the first frame, with their stamps or without."""
    last: dict[str, Any] = {}

    def stuck(frame: SensorFrame) -> SensorFrame:
        if not last:
            last.update({name: copy.copy(getattr(frame, name)) for name in names})
            for stamp in {channels(SensorFrame)[name].stamp for name in names} if stamps else ():
                last[stamp] = frame.stamp_ns if (taken := getattr(frame, stamp)) is None else taken
        return dataclasses.replace(frame, **last)

    return stuck


def not_numbers(names: Sequence[str]) -> FrameFilter:
    """NaN in every entry of channels."""
    bad: dict[str, Any] = {}
    for name in names:
        shape = channels(SensorFrame)[name].shape
        bad[name] = np.full(shape, math.nan) if shape else math.nan
    return lambda frame: dataclasses.replace(frame, **bad)
