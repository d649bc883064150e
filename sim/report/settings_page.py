"""The page of all settings: every key of every TOML file, from the declarations of its dataclasses.

``python -m sim.report.settings_page > docs/settings.md`` renews it; a test compares the page with the declarations.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

from ibvs_qp.config.settings import Derived
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.interfaces.px4.config import BridgeConfig
from ibvs_qp.interfaces.ros.topics import Topics
from ibvs_qp.pilot.config import PilotConfig
from sim.evaluate.table import markdown
from sim.world.scene import Scene

HEAD = """# Settings

Every key of every TOML file, with its default and its range. A file states only the keys that differ; an unknown key, a
value of another type and a value out of its range are refused by name. A *derived* value follows from others while it
is not stated; the page has that of the default vehicle.

Written by `python -m sim.report.settings_page` from the declarations; a test compares the page with them.
"""
#: Kinds of files: title, class and use.
FILES = (
    ("Flight", PilotConfig, "`--preset` of the commands, `PilotConfig.from_toml`"),
    ("Vehicle", VehicleParams, "`--vehicle` of the commands, and the table `controller.vehicle` of a flight"),
    ("Scene", Scene, "`--scene` of the commands: the simulated world"),
    ("Topics", Topics, "`--topics` of `ibvs-qp replay BAG` and `detect`, `Bag(path, topics)`"),
    ("Bridge to PX4", BridgeConfig, "`--config` of `ibvs-qp bridge`"),
)


def settings_page() -> str:
    """The page as Markdown."""
    parts = [HEAD]
    for title, kind, use in FILES:
        parts.append(f"\n## {title}\n\nRead by {use}.\n")
        parts += [_section(f"{title}: {name}" if name else "", section) for name, section in _sections(kind())]
    return "".join(parts)


def _sections(section: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Tables of a settings tree by dotted name, parents first; the vehicle has a file of its own."""
    yield path, section
    for field in dataclasses.fields(section):
        value = getattr(section, field.name)
        if dataclasses.is_dataclass(value) and not isinstance(value, VehicleParams):
            yield from _sections(value, f"{path}.{field.name}".lstrip("."))


def _section(title: str, section: Any) -> str:
    rows = []
    for field in dataclasses.fields(section):
        if meta := field.metadata:
            words = meta["doc"] + (f" ({meta['why']})" if meta.get("why") else "")
            default, allowed = _default(getattr(section, field.name)), _allowed(field.default, meta)
            cells = f"`{field.name}`", default, meta["unit"], allowed, words
            rows.append([cell.replace("|", "/") for cell in cells])
    table = markdown(("Key", "Default", "Unit", "Range", "Meaning"), rows) if rows else ""
    return (f"\n### {title}\n" if title and rows else "") + (f"\n{table}" if rows else "")


def _default(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, tuple):
        return f"`[{', '.join(f'{each:g}' for each in value)}]`"
    if isinstance(value, float):
        return f"`{value:.4g}`" + " *derived*" * (type(value) is Derived)
    return f'`"{value}"`' if isinstance(value, str) else f"`{value}`".lower()


def _allowed(default: Any, meta: Any) -> str:
    """Options, or the finite bounds of a number."""
    if "options" in meta:
        return ", ".join(f"`{each}`" for each in meta["options"])
    if isinstance(default, (bool, str)):
        return ""
    low, high = meta["low"], meta["high"]
    bounds = [f"from {low:g}"] * math.isfinite(low) + [f"to {high:g}"] * math.isfinite(high)
    return " ".join(bounds) + "".join(f" or `{word}`" for word in meta["words"])


if __name__ == "__main__":
    print(settings_page(), end="")
