"""A folder of frames: what its manifest.csv says, and which frames follow on each other."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

from ibvs_qp.config.errors import IbvsQpError

#: Columns that must be there; seed_u, seed_v and depth may be empty in a row.
COLUMNS = ("color", "depth", "fx", "fy", "cx", "cy", "depth_units_per_m", "seed_u", "seed_v")
#: PREFIX_NUMBER_color: numbers that follow on by one are a motion sequence.
_NUMBERED = re.compile(r"(?P<prefix>.*)_(?P<number>\d+)_color$")


class ManifestError(IbvsQpError):
    """The manifest cannot be used."""


@dataclass(frozen=True, kw_only=True)
class FrameEntry:
    """One frame to look at.

    Attributes:
        color: Colour file, as the manifest names it.
        depth: Depth file, or "" if there is none.
        folder: Where both lie.
        intrinsics: (fx, fy, cx, cy) [px].
        depth_units_per_metre: Depth values per metre.
        seed: (u, v) of a place on the surface [px], or None.
    """

    color: str
    depth: str
    folder: Path
    intrinsics: tuple[float, float, float, float]
    depth_units_per_metre: float
    seed: tuple[float, float] | None

    @property
    def number(self) -> tuple[str, int] | None:
        """Prefix and number of a motion sequence, None for a picture that stands alone."""
        match = _NUMBERED.fullmatch(Path(self.color).stem)
        return (match["prefix"], int(match["number"])) if match else None


def read_manifest(folder: Path) -> list[FrameEntry]:
    """Read a folder's manifest.csv.

    Raises:
        ManifestError: When it is missing, lacks a column or holds a value that is no number.
    """
    file = folder / "manifest.csv"
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.DictReader(stream)
            missing = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
            if missing:
                raise ManifestError(f"{file} lacks the column {missing[0]!r}; needed are {', '.join(COLUMNS)}")
            rows = list(reader)
    except OSError as error:
        raise ManifestError(f"cannot read {file}: {error.strerror or error}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ManifestError(f"{file} is no table of comma-separated values: {error}") from None
    if not rows:
        raise ManifestError(f"{file} names no frame")
    return [_entry(file, line, row) for line, row in enumerate(rows, 2)]


def motion_sequences(entries: list[FrameEntry]) -> list[list[int]]:
    """Indices of the frames to be looked at one after the other; pictures that stand alone are groups of one."""
    numbered = sorted((entry.number, index) for index, entry in enumerate(entries) if entry.number is not None)
    groups: list[list[int]] = [[index] for index, entry in enumerate(entries) if entry.number is None]
    before: tuple[str, int] | None = None
    for number, index in numbered:
        assert number is not None
        if before is not None and number == (before[0], before[1] + 1):
            groups[-1].append(index)
        else:
            groups.append([index])
        before = number
    return sorted(groups)


def _entry(file: Path, line: int, row: dict[str, str | None]) -> FrameEntry:
    def number(name: str, low: float = -math.inf) -> float:
        text = (row[name] or "").strip()
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value > low):
            need = "a number" if low == -math.inf else f"a number above {low:g}"
            raise ManifestError(f"{file}, line {line}: {name} = {text!r} is refused: {need} is needed")
        return value

    color = (row["color"] or "").strip()
    if not color:
        raise ManifestError(f"{file}, line {line}: no colour file is named")
    seeded = bool((row["seed_u"] or "").strip() and (row["seed_v"] or "").strip())
    return FrameEntry(
        color=color,
        depth=(row["depth"] or "").strip(),
        folder=file.parent,
        intrinsics=(number("fx", 1.0), number("fy", 1.0), number("cx"), number("cy")),
        depth_units_per_metre=number("depth_units_per_m", 0.0),
        seed=(number("seed_u"), number("seed_v")) if seeded else None,
    )
