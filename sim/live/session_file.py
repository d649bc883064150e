"""Session file: the beginning of a flight and its changes with their ticks; it repeats the flight. And its preset."""

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
from ibvs_qp.pilot.painting.config import PaintingConfig
from sim.flight.jobs import Job, PaintJob, PressJob
from sim.flight.options import FlightOptions
from sim.storage.arrays import read_json
from sim.storage.atomic import write_text
from sim.world.scene import Scene

SCHEMA = 1
_HEAD = "# Changes against the shipped preset; every other value has its default."
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


def changed_keys(table: dict[str, Any], base: dict[str, Any]) -> dict[str, Any]:
    """Keys of a table whose values differ from another's, section by section."""
    changed: dict[str, Any] = {}
    for name, value in table.items():
        if isinstance(value, dict) and isinstance(base.get(name), dict):
            if inner := changed_keys(value, base[name]):
                changed[name] = inner
        elif value != base.get(name):
            changed[name] = value
    return changed


def changes_text(config: PilotConfig, task: PaintingConfig, thrust_max_n: float) -> str:
    """A preset of the changes alone: every key that differs from its default; `PilotConfig.from_toml` reads it.

    Args:
        config: The configuration.
        task: The paint job flown: its push and speed belong to the scene, and stand in comments.
        thrust_max_n: Upper thrust limit of the session [N], which a preset does not hold.
    """
    import tomli_w

    base = to_dict(PilotConfig(law=config.law), derived=True)
    table = changed_keys(to_dict(config), base)
    for name in ("painting", "vision"):  # follow from the scene
        table.pop(name, None)
    controller = table.get("controller", {})
    for section in ("vehicle", "solver"):  # calibration of the scene's camera; the machine's backend
        calibrated = {"camera_size_px", "camera_intrinsics_px", "backend"}
        kept = {name: value for name, value in controller.pop(section, {}).items() if name not in calibrated}
        if kept:
            controller[section] = kept
    if not controller:
        table.pop("controller", None)
    job = f"# The scene's [paint]: push_n = {task.push_n:g}, speed_m_s = {task.speed_m_s:g}"
    lowered = thrust_max_n < config.controller.vehicle.thrust_max.max()
    limit = [f"# The thrust limit of {thrust_max_n:g} N is in session.json alone."] if lowered else []
    return "\n".join([_HEAD, job, *limit, "", tomli_w.dumps(table)])
