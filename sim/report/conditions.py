"""Differences of two runs: options, scene and presets, key by key."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

from ibvs_qp.config.files import UnreadableFile, parse_toml, read_toml
from ibvs_qp.pilot import PilotConfig
from sim.report.summary_file import FACTS, read_facts
from sim.storage.json_file import read_json

#: A key that one side lacks.
ABSENT = "–"


def run_world(folder: Path) -> str | None:
    """World of a run of `paint` or of an experiment, as its record names it; None where it names none."""
    files = [file] if (file := folder / "summary.json").is_file() else sorted(folder.glob("*.json"))
    for file in files:
        with contextlib.suppress(UnreadableFile):
            content = read_json(file)
            if isinstance(content, dict) and isinstance(content.get("world"), str):
                return content["world"]
    return None


def differing_runs(a: Path, b: Path) -> list[dict[str, Any]]:
    """Differing facts, scene and presets of two `paint` runs; runs of experiments name theirs in their tables.

    Args:
        a: Run folder.
        b: The other one.

    Returns:
        Per difference: name, and its value in a and b.

    Raises:
        ConfigError: When a file is none of a run.
    """
    if not all((path / "summary.json").is_file() for path in (a, b)):
        return []
    first, second = (read_facts(path / "summary.json") for path in (a, b))
    pairs: list[tuple[str, dict[str, Any], dict[str, Any]]] = [
        ("", {name: first[name] for name in FACTS}, {name: second[name] for name in FACTS})
    ]
    names = ["scene.toml", *sorted(file.name for file in a.glob("preset_*.toml"))]
    for name in names:
        if (a / name).is_file() and (b / name).is_file():
            pairs.append((f"{Path(name).stem}.", read_toml(a / name), read_toml(b / name)))
    found = [each for prefix, x, y in pairs for each in _differences(prefix, x, y)]
    if any(each["name"] == "world" for each in found):  # which is shorter than its numbers
        found = [each for each in found if not each["name"].startswith("scene.errors.")]
    return found


def differing_presets(a: Path, b: Path) -> list[dict[str, Any]]:
    """Differing keys of two presets, defaults filled in."""
    first, second = (parse_toml(PilotConfig.from_toml(file).to_toml(derived=True), file) for file in (a, b))
    return _differences("preset.", first, second)


def _differences(prefix: str, a: dict[str, Any], b: dict[str, Any]) -> list[dict[str, Any]]:
    x, y = _flat(prefix, a), _flat(prefix, b)
    names = [*x, *(name for name in y if name not in x)]
    pairs = ((name, x.get(name, ABSENT), y.get(name, ABSENT)) for name in names)
    return [{"name": name, "a": first, "b": second} for name, first, second in pairs if first != second]


def _flat(prefix: str, table: dict[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in table.items():
        flat |= _flat(f"{prefix}{name}.", value) if isinstance(value, dict) else {prefix + name: value}
    return flat
