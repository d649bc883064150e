"""Real RGB-D frames of a folder whose manifest.csv names pictures, camera and a place on the surface."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.measurement import RgbdFrame

#: Files of the folder and the columns that are read.
MANIFEST = "manifest.csv"
_COLUMNS = ("color", "depth", "fx", "fy", "cx", "cy", "depth_units_per_m", "seed_u", "seed_v")


class RealFramesError(IbvsQpError):
    """The folder of real frames cannot be used."""


def real_frames(folder: Path) -> Iterator[tuple[RgbdFrame, tuple[float, float]]]:
    """Frames with a place on the surface (u, v) [px]; frames without one, and their lines, are left out.

    Raises:
        RealFramesError: When the manifest or a picture is missing, or a number is none.
    """
    file = folder / MANIFEST
    if not file.is_file():
        raise RealFramesError(f"{file} is missing; --real takes a folder with a {MANIFEST}")
    with file.open(newline="", encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    for number, row in enumerate(rows):
        missing = [name for name in _COLUMNS if row.get(name) is None]
        if missing:
            raise RealFramesError(f"{file}: column {missing[0]} is missing")
        if not row["seed_u"]:
            continue
        rgb = cv2.imread(str(folder / row["color"]), cv2.IMREAD_COLOR_RGB)
        raw = cv2.imread(str(folder / row["depth"]), cv2.IMREAD_UNCHANGED)
        if rgb is None or raw is None or raw.shape != rgb.shape[:2]:
            raise RealFramesError(f"{file}: {row['color']} and {row['depth']} are no pair of pictures of one size")
        try:
            fx, fy, cx, cy, units, u, v = (float(row[name]) for name in _COLUMNS[2:])
        except ValueError as problem:
            raise RealFramesError(f"{file}, line {number + 2}: {problem}") from None
        if not (math.isfinite(units) and units > 0.0):
            raise RealFramesError(f"{file}, line {number + 2}: depth_units_per_m must be positive")
        depth = raw.astype(np.float32) / np.float32(units)
        stamp = round(1e9 / 30.0) * (number + 1)
        yield RgbdFrame(rgb=rgb, depth=depth, intrinsics=(fx, fy, cx, cy), stamp_ns=stamp), (u, v)
