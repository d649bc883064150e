"""Task of a flight at the wall: paint, press and slide, or a strategy of the user's."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from ibvs_qp.config.settings import setting, validate
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.painter import Painter
from ibvs_qp.pilot.painting.presser import Presser
from ibvs_qp.pilot.painting.strategy import Strategy, require_strategy
from sim.flight.own_class import built


class Job(Protocol):
    """Creates the pilot's strategy; frozen, so that it can be pickled and compared by its repr."""

    def strategy(self, config: PaintingConfig) -> Strategy:
        """The strategy of one flight."""
        ...

    def expected_s(self, config: PaintingConfig, strokes: int) -> float:
        """Flying time at the wall to expect for a number of strokes [s]."""
        ...

    @property
    def plan(self) -> dict[str, float]:
        """Least durations of the phases of a job without strokes [s]; empty for a paint job."""
        ...


@dataclass(frozen=True, kw_only=True)
class PaintJob:
    """Paint the rows of the scene."""

    def strategy(self, config: PaintingConfig) -> Painter:
        """The painter."""
        return Painter(config)

    def expected_s(self, config: PaintingConfig, strokes: int) -> float:
        """Strokes and climbs at their speed."""
        return (strokes * config.stroke_m + (strokes - 1) * config.pitch_m) / config.speed_m_s

    @property
    def plan(self) -> dict[str, float]:
        """None: the scene has its strokes."""
        return {}


@dataclass(frozen=True, kw_only=True)
class PressJob:
    """Press for `hold_s`, then slide for `slide_s`; after a lost rotor descend for `descend_s` [s]."""

    hold_s: float = setting(8.0, "time at one place after the touch", unit="s", low=0.0, high=600.0)
    slide_s: float = setting(0.0, "time of sliding after that", unit="s", low=0.0, high=600.0)
    descend_s: float = setting(5.0, "time of the descent after a lost rotor", unit="s", low=0.0, high=600.0)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)

    def strategy(self, config: PaintingConfig) -> Painter:
        """The presser."""
        return Presser(config, self.hold_s, self.slide_s, self.descend_s)

    def expected_s(self, config: PaintingConfig, strokes: int) -> float:
        """Hold and slide."""
        return self.hold_s + self.slide_s

    @property
    def plan(self) -> dict[str, float]:
        """Hold in phase ``press``, slide in phase ``paint``; ``descend`` after a lost rotor."""
        return {"press": self.hold_s, "paint": self.slide_s, "descend": self.descend_s}


@dataclass(frozen=True, kw_only=True)
class OwnJob:
    """Fly a strategy of the user's: ``module:Class`` or ``file.py:Class``."""

    name: str

    def strategy(self, config: PaintingConfig) -> Strategy:
        """A new one.

        Raises:
            ConfigError: When it cannot be loaded or constructed.
        """
        return require_strategy(built(self.name, Strategy, "--strategy", config))  # type: ignore[type-abstract]

    def expected_s(self, config: PaintingConfig, strokes: int) -> float:
        """Its legs at painting speed; those of the paint job where it has none."""
        legs = sum(math.hypot(*leg) for leg in self.strategy(config).legs)
        return legs / config.speed_m_s if legs > 0.0 else PaintJob().expected_s(config, strokes)

    @property
    def plan(self) -> dict[str, float]:
        """None: its legs are scored."""
        return {}
