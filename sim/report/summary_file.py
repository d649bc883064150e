"""summary.json of a run folder of unknown origin: its facts and laws, of the types that `paint` writes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import shown
from ibvs_qp.config.files import INTEGERS, UnreadableFile
from sim.storage.json_file import read_json
from sim.sweep.parts import HEAD

#: Facts of a run that change its figures, and their types; an older run may lack one.
FACTS = {
    "version": str,
    "seed": int,
    "world": str,
    "features": str,
    "vision": str,
    "camera": str,
    "image_size": list,
}
#: Keys of every law in addition to its figures.
_OUTCOME = {"completed": bool, "reason": str}


def read_facts(file: Path) -> dict[str, Any]:
    """Facts of a run, None for an absent one, and its laws if it has them.

    Args:
        file: The summary.json.

    Returns:
        The values of `FACTS`, and `laws` as in the file.

    Raises:
        UnreadableFile: When it cannot be read, or a fact has another type.
    """
    content = _typed(file, "the file", read_json(file), dict)
    facts = {name: _typed(file, name, content[name], kind) for name, kind in FACTS.items() if name in content}
    for entry in facts.get("image_size", ()):
        _typed(file, "image_size", entry, int)
    return {name: facts.get(name) for name in FACTS} | {"laws": content.get("laws")}


def read_laws(file: Path) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Facts of a run and, per law, its outcome and its figures [float].

    Raises:
        UnreadableFile: When it is not the summary of a run.
    """
    facts, laws = read_facts(file), {}
    for name in ("version", "seed"):
        _typed(file, name, facts[name], FACTS[name])
    for law, metrics in _typed(file, "laws", facts["laws"], dict).items():
        _typed(file, "a law's name", law, str)
        _typed(file, law, metrics, dict)
        own = {name: value for name, value in metrics.items() if name.isidentifier() and name not in HEAD}
        figures = {name: float(value) for name, value in own.items() if _is_figure(value)}
        outcome = {name: _typed(file, f"{law}.{name}", metrics.get(name), kind) for name, kind in _OUTCOME.items()}
        laws[law] = figures | outcome
    if not laws:
        raise UnreadableFile(file, "not the summary of a run: it has no law")
    return facts, laws


def _typed(file: Path, name: str, value: Any, kind: type) -> Any:
    """The value if it has exactly the type; text must print, and an integer fit a table."""
    fits = type(value) is kind and (kind is not int or value in INTEGERS) and (kind is not str or _prints(value))
    if not fits:
        raise UnreadableFile(
            file, f"not the summary of a run: {shown(name)} = {shown(value)}, expected {kind.__name__}"
        )
    return value


def _prints(text: str) -> bool:
    return text.replace("\n", " ").isprintable()


def _is_figure(value: Any) -> bool:
    return type(value) is float or (type(value) is int and abs(value) <= sys.float_info.max)
