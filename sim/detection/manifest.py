"""A folder of frames: its manifest.csv, and its motion sequences."""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.config.files import read_bytes
from ibvs_qp.vision.picture.settings import RgbdCameraSettings
from sim.storage.limits import LARGEST_MANIFEST, MOST_FRAMES

#: Required columns; seed_u, seed_v and depth may be empty in a row.
COLUMNS = ("color", "depth", "fx", "fy", "cx", "cy", "depth_units_per_m", "seed_u", "seed_v")
#: Optional columns: settings of the camera by name, their numbers separated by blanks; empty for those of the command.
CAMERA_COLUMNS = (
    "distortion",
    "color_bits",
    "depth_intrinsics",
    "depth_distortion",
    "depth_rotation",
    "depth_translation_m",
)
#: Largest focal length, and largest distance of the principal point from the corner [px]: a hundred times those of any
#: camera; far beyond, squares of image coordinates overflow.
LARGEST_PX = 1e6
#: PREFIX_NUMBER_color: consecutive numbers are a motion sequence.
_NUMBERED = re.compile(r"(?P<prefix>.*)_(?P<number>\d+)_color$")
#: Most digits of the number of a frame [-]: nanoseconds since 1970 have 19.
MOST_DIGITS = 20


@dataclass(frozen=True, kw_only=True)
class FrameEntry:
    """One frame."""

    color: str  # colour file, as in the manifest
    depth: str  # depth file, or "" without one
    folder: Path  # folder of both
    intrinsics: tuple[float, float, float, float]  # (fx, fy, cx, cy) [px]
    depth_units_per_metre: float  # depth values per metre
    seed: tuple[float, float] | None  # (u, v) of a point on the surface [px], or None
    camera: RgbdCameraSettings = field(default_factory=RgbdCameraSettings)  # lenses and depth camera


def read_manifest(folder: Path, camera: RgbdCameraSettings | None = None) -> list[FrameEntry]:
    """Read a folder's manifest.csv.

    Args:
        folder: The folder.
        camera: Settings that no column states.

    Raises:
        ConfigError: When it is missing, lacks a column or has a value that is no number.
    """
    file = folder / "manifest.csv"
    content = read_bytes(file, LARGEST_MANIFEST)
    try:
        reader = csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline=""), restval="")
        missing = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
        if missing:
            raise ConfigError(f"{file} lacks the column {missing[0]!r}; needed are {', '.join(COLUMNS)}")
        names = [*COLUMNS, *(name for name in CAMERA_COLUMNS if name in (reader.fieldnames or ()))]
        rows = [{name: row[name].strip() for name in names} for row in itertools.islice(reader, MOST_FRAMES)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ConfigError(f"{file} is no table of comma-separated values: {error}") from None
    if len(rows) == MOST_FRAMES:
        raise ConfigError(f"{file} names {MOST_FRAMES} frames or more")
    if not rows:
        raise ConfigError(f"{file} names no frame")
    default = camera or RgbdCameraSettings()
    return [_entry(folder, f"{file}, line {line}", row, default) for line, row in enumerate(rows, 2)]


def motion_sequences(entries: list[FrameEntry]) -> list[list[int]]:
    """Indices of the frames of every motion sequence, in order; single pictures are groups of one."""
    groups, last = [], ("", -1, [])
    numbered: list[tuple[str, int, int]] = []
    for index, entry in enumerate(entries):
        match = _NUMBERED.fullmatch(Path(entry.color).stem)
        if match:
            numbered.append((match["prefix"], int(match["number"]), index))
        else:
            groups.append([index])
    for prefix, number, index in sorted(numbered):
        group = last[2] if (prefix, number) == (last[0], last[1] + 1) else []
        if not group:
            groups.append(group)
        group.append(index)
        last = prefix, number, group
    return sorted(groups)


def _entry(folder: Path, place: str, row: dict[str, str], camera: RgbdCameraSettings) -> FrameEntry:
    def number(name: str, low: float = -math.inf, high: float = sys.float_info.max) -> float:
        try:
            value = float(row[name])
        except ValueError:
            value = math.nan
        if not low < value <= high:
            need = "a number" + (f" above {low:g}" if low > -math.inf else "")
            need += f", at most {high:g}" if high < sys.float_info.max else ""
            raise ConfigError(f"{place}: {name} = {shown(row[name])} is refused: {need} is needed")
        return value

    if not row["color"]:
        raise ConfigError(f"{place}: no colour file is named")
    match = _NUMBERED.fullmatch(Path(row["color"]).stem)
    if match and len(match["number"]) > MOST_DIGITS:
        allowed = f"a frame's number has at most {MOST_DIGITS} digits"
        raise ConfigError(f"{place}: color = {shown(row['color'])} is refused: {allowed}")
    return FrameEntry(
        color=row["color"],
        depth=row["depth"],
        folder=folder,
        intrinsics=(
            number("fx", 1.0, LARGEST_PX),
            number("fy", 1.0, LARGEST_PX),
            number("cx", -LARGEST_PX, LARGEST_PX),
            number("cy", -LARGEST_PX, LARGEST_PX),
        ),
        depth_units_per_metre=number("depth_units_per_m", 0.0),
        seed=(number("seed_u"), number("seed_v")) if row["seed_u"] and row["seed_v"] else None,
        camera=_camera(place, row, camera),
    )


def _camera(place: str, row: dict[str, str], default: RgbdCameraSettings) -> RgbdCameraSettings:
    """Settings with those that a row states."""
    stated: dict[str, Any] = {}
    for name in CAMERA_COLUMNS:
        if not (words := row.get(name, "").split()):
            continue
        try:
            stated[name] = int(words[0]) if name == "color_bits" else tuple(map(float, words))
        except ValueError:
            need = "numbers separated by blanks are needed"
            raise ConfigError(f"{place}: {name} = {shown(row[name])} is refused: {need}") from None
    try:
        return replace(default, **stated)
    except ConfigError as error:
        raise ConfigError(f"{place}: {error}") from None
