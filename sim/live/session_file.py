"""Session file: the beginning of a flight and its changes with their ticks; it repeats the flight."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import ibvs_qp
from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.config.files import UnreadableFile, parse_toml
from ibvs_qp.config.settings import from_dict, to_dict
from ibvs_qp.pilot import PilotConfig
from sim.flight.jobs import Job, PaintJob, PressJob
from sim.flight.options import FlightOptions
from sim.storage.arrays import read_json
from sim.storage.atomic import write_text
from sim.world.scene import Scene

SCHEMA = 1
#: Longest session that is read [ticks], and most changes in it [-].
MOST_TICKS, MOST_CHANGES = 10_000_000, 100_000


@dataclass(frozen=True, kw_only=True)
class Start:
    """Beginning of a session: equal ones with equal changes give bit-identical flights."""

    scene: Scene = field(default_factory=Scene)
    preset: PilotConfig = field(default_factory=lambda: ibvs_qp.preset("qp"))
    seed: int = 0
    features: str = "geometric"
    press: PressJob | None = None  # instead of the scene's paint job

    @property
    def job(self) -> Job:
        """Task at the wall."""
        return self.press or PaintJob()

    def options(self, law: str) -> FlightOptions:
        """Options of the flight of one law; both interpreted or both compiled are the same bits."""
        return FlightOptions(law=law, seed=self.seed, features=self.features, video=False, compiled=True)

    def config(self, law: str) -> PilotConfig:
        """Configuration of one law: the preset of the session, or the shipped one of the analytic law."""
        return self.preset if law == self.preset.law else ibvs_qp.preset(law)


@dataclass(frozen=True, kw_only=True)
class Change:
    """A change of the flight before a tick.

    Attributes:
        tick: Ticks flown before it.
        kind: "set" (gains, weights, limits, solver), "task" (push, speed), "thrust" (upper limit) or "fault".
        values: Names and values.
    """

    tick: int
    kind: str
    values: dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class SessionFile:
    """Contents of a session file."""

    start: Start
    changes: tuple[Change, ...]
    ticks: int  # flown
    digest: str  # of commands and truth of every tick

    def write(self, file: Path) -> None:
        """Write it.

        Raises:
            UnwritableFile: When the system does not let it.
        """
        start = self.start
        table = {
            "schema": SCHEMA,
            "seed": start.seed,
            "features": start.features,
            "press": None if start.press is None else to_dict(start.press),
            "ticks": self.ticks,
            "digest": self.digest,
            "changes": [dataclasses.asdict(change) for change in self.changes],
            "scene": to_dict(start.scene),
            "preset": start.preset.to_toml(),
        }
        write_text(file, json.dumps(table, indent=1) + "\n")

    @classmethod
    def read(cls, file: Path) -> SessionFile:
        """Read one.

        Raises:
            UnreadableFile: When it is no session file.
        """
        table = read_json(file)
        try:
            if table["schema"] != SCHEMA:
                raise ValueError(f"schema {table['schema']!r}, not {SCHEMA}")
            press = table["press"]
            start = Start(
                scene=from_dict(Scene, table["scene"]),
                preset=from_dict(PilotConfig, parse_toml(table["preset"], file)),
                seed=_count(table["seed"], 2**31 - 1),
                features=table["features"],
                press=None if press is None else from_dict(PressJob, press),
            )
            if start.features not in ("geometric", "rendered"):
                raise ValueError(f"features {start.features!r}")
            if len(table["changes"]) > MOST_CHANGES:
                raise ValueError(f"more than {MOST_CHANGES} changes")
            changes = tuple(_change(each) for each in table["changes"])
            ticks = _count(table["ticks"], MOST_TICKS)
            if [each.tick for each in changes] != sorted(each.tick for each in changes):
                raise ValueError("changes out of order")
            return cls(start=start, changes=changes, ticks=ticks, digest=str(table["digest"]))
        except KeyError as error:
            raise UnreadableFile(file, f"no session: it has no {error}") from None
        except (ConfigError, TypeError, ValueError, AttributeError) as error:
            raise UnreadableFile(file, f"no session: {error}") from None


def _change(table: Any) -> Change:
    values, kind = dict(table["values"]), table["kind"]
    if not isinstance(kind, str):
        raise ValueError(f"kind {shown(kind)}")
    return Change(tick=_count(table["tick"], MOST_TICKS), kind=kind, values=values)


def _count(value: Any, most: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
        raise ValueError(f"{value!r} is no whole number from 0 to {most}")
    return value
