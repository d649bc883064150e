"""Traces of a flight whose process was killed, from the rows that its journal left."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import UnreadableFile, parse_toml, read_bytes
from ibvs_qp.config.settings import from_dict
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.painting.strategy import PHASES
from sim.flight.assemble import OUTCOMES, Flown, LoggedRows, assemble
from sim.flight.journal import NOTES, ROWS, Header, split
from sim.flight.trace import FIELDS, KILLED, LAWS, Event, Trace
from sim.storage.limits import LARGEST_ARRAYS
from sim.world.scene import Scene

#: Arrays of indices and the arrays of names that they point into.
_INDICES = {"phase": "phases", "outcome": "outcomes"}
#: Arrays of names.
_NAMES = {*_INDICES.values(), "limits"}


def check_arrays(arrays: Mapping[str, np.ndarray]) -> None:
    """Check the arrays of one law against `FIELDS`; arrays that an older log lacks are no error.

    Raises:
        ValueError: Naming the array.
    """
    if "t" not in arrays:
        raise ValueError("array t is missing")
    sizes: dict[str, int] = {}
    for name in FIELDS.keys() & arrays.keys():
        array, letters = arrays[name], _letters(name)
        fixed = tuple(int(x) if x.isdigit() else sizes.setdefault(x, n) for x, n in zip(letters, array.shape))  # noqa: B905
        if array.dtype.kind not in "biuf" or len(letters) != array.ndim or fixed != array.shape:
            needed = ", ".join(f"{x} = {sizes[x]}" if x in sizes else x for x in letters)
            raise ValueError(f"array {name} has shape {array.shape} of {array.dtype}, needed are numbers ({needed})")
    for name in _NAMES & arrays.keys():
        array = arrays[name]
        if array.ndim != 1 or array.dtype.kind != "U":
            raise ValueError(f"array {name} has shape {array.shape} of {array.dtype}, expected a list of names")
    if sizes.get("L", 0) < len(arrays["limits"]):
        raise ValueError(f"{len(arrays['limits'])} limits are named, the arrays have {sizes.get('L', 0)} columns")
    if not (np.isfinite(arrays["t"]).all() and (np.diff(arrays["t"]) > 0.0).all()):
        raise ValueError("array t does not increase")
    for name, names in _INDICES.items():
        if name in arrays and not np.isin(arrays[name], np.arange(len(arrays[names]))).all():
            raise ValueError(f"array {name} has an index outside {names}")


def _letters(name: str) -> list[str]:
    """Sizes of an array in the words of `FIELDS`: "(N,3) true ..." has N and 3."""
    return [letter for letter in FIELDS[name][1:].split(")")[0].split(",") if letter]


#: Beginning of the names of journals' folders in a run folder.
JOURNALS = "partial-"
#: Errors of content that no journal wrote.
_DAMAGE = (ArithmeticError, AttributeError, ConfigError, LookupError, RecursionError, TypeError, ValueError)


def unfinished_run(path: Path) -> dict[str, Trace]:
    """Traces of the newest journal in a run folder, one per law; none without a journal.

    Raises:
        ConfigError: When a journal is damaged elsewhere than at its end.
    """
    for folder in sorted(path.glob(f"{JOURNALS}*"), key=lambda each: each.stat().st_mtime, reverse=True):
        files = [file for law in LAWS if (file := folder / f"{law}{NOTES}").exists()]
        if files:
            return {file.stem: _read(file) for file in files}
    return {}


def _read(file: Path) -> Trace:
    content, rows = read_bytes(file, LARGEST_ARRAYS), read_bytes(file.with_suffix(ROWS), LARGEST_ARRAYS)
    try:
        first, *notes = _lines(content)
        return _trace(Header(**first), notes, rows)
    except _DAMAGE as error:
        raise UnreadableFile(file, f"no journal of a flight ({type(error).__name__}: {error})") from None


def _lines(content: bytes) -> Iterator[dict[str, Any]]:
    """The complete lines; the last one ends where the process died."""
    *lines, _ = content.split(b"\n")
    return map(json.loads, lines)


def _trace(header: Header, notes: list[dict[str, Any]], content: bytes) -> Trace:
    scene = from_dict(Scene, parse_toml(header.scene, "scene"))
    config = from_dict(PilotConfig, parse_toml(header.preset, "preset"))
    flown = Flown.of(scene, int(header.seed), str(header.law), config)
    table = np.zeros(min(len(content) // header.row.itemsize, sum(note["ticks"] for note in notes)), header.row)
    table.view(np.uint8)[:] = memoryview(content)[: table.nbytes]
    columns = split(np.ascontiguousarray(table["log"]), header.columns)
    limits: dict[str, int] = {}
    active = {
        int(tick): [(limits.setdefault(name, len(limits)), price) for name, price in paid]
        for note in notes
        for tick, paid in note["limits"].items()
        if int(tick) < len(table)
    }
    rows = LoggedRows(
        columns=columns,
        program=np.ascontiguousarray(table["program"]) if header.program else None,
        limits=tuple(limits),
        active=active,
        vision_ms=[value for note in notes for value in note["vision_ms"]],
        thrust_limits=(flown.vehicle.thrust_min, flown.vehicle.thrust_max),
    )
    with np.errstate(all="ignore"):  # numbers from a file may be anything
        arrays = assemble(flown, rows)
    names = {"phases": PHASES, "outcomes": OUTCOMES, "limits": rows.limits}
    check_arrays(arrays | {name: np.array(each) for name, each in names.items()})
    end = Event(t=float(arrays["t"][-1]) if len(table) else 0.0, kind="end", text=KILLED)
    return Trace(
        scene=scene,
        seed=flown.seed,
        law=flown.law,
        arrays=arrays,
        phases=PHASES,
        outcomes=OUTCOMES,
        limits=rows.limits,
        events=[*(Event(t=float(t), kind=kind, text=text) for note in notes for t, kind, text in note["events"]), end],
        reason=KILLED,
        preset=header.preset,
    )
