"""Lists of lines, features and optional vectors as plain arrays, and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ibvs_qp import FeatureFrame, LineFeature, LineReference

Table = dict[str, np.ndarray]


def vectors(values: Sequence[Any], width: int, kind: type) -> np.ndarray:
    """One row per value, (count, width); a row of NaN where there is none."""
    table = np.full((len(values), width), np.nan)
    for row, value in zip(table, values, strict=True):
        if value is not None:
            row[:] = np.ravel(value)
    return table.astype(kind)


def vector(row: np.ndarray) -> np.ndarray | None:
    """The value of a row in double precision, or None."""
    return None if np.isnan(row[0]) else row.astype(float)


def part(table: Table, prefix: str) -> Table:
    """The columns whose name begins with the prefix, without it."""
    return {name.removeprefix(prefix): column for name, column in table.items() if name.startswith(prefix)}


def with_prefix(prefix: str, table: Table) -> Table:
    """The same columns under longer names."""
    return {prefix + name: column for name, column in table.items()}


def line_table(lines: Sequence[Sequence[LineFeature]], kind: type) -> Table:
    """Columns of all lines of all ticks; `tick` says where each belongs."""
    flat = [line for those in lines for line in those]
    return {
        "tick": np.repeat(np.arange(len(lines)), [len(those) for those in lines]),
        "rho": np.array([line.rho for line in flat], kind),
        "theta": np.array([line.theta for line in flat], kind),
        "covariance": vectors([line.covariance for line in flat], 4, kind),
        "segment": vectors([line.segment for line in flat], 4, kind),
        "weight": np.array([line.weight for line in flat], kind),
        "stamp_ns": np.array([line.stamp_ns for line in flat], np.int64),
        "track_id": np.array([line.track_id for line in flat], np.int64),
        "surface_side": np.array([line.surface_side for line in flat], np.int64),
        "role": np.array([line.role for line in flat], str),
        "kind": np.array([line.kind for line in flat], str),
    }


def lines_of(table: Table, ticks: int) -> list[tuple[LineFeature, ...]]:
    """The lines of every tick."""
    lines: list[list[LineFeature]] = [[] for _ in range(ticks)]
    for index, tick in enumerate(table["tick"]):
        segment = vector(table["segment"][index])
        line = LineFeature(
            rho=float(table["rho"][index]),
            theta=float(table["theta"][index]),
            covariance=table["covariance"][index].astype(float).reshape(2, 2),
            segment=None if segment is None else segment.reshape(2, 2),
            weight=float(table["weight"][index]),
            stamp_ns=int(table["stamp_ns"][index]),
            track_id=int(table["track_id"][index]),
            surface_side=int(table["surface_side"][index]),
            role=str(table["role"][index]),
            kind=str(table["kind"][index]),
        )
        lines[tick].append(line)
    return [tuple(those) for those in lines]


def reference_table(lines: Sequence[Sequence[LineReference]], kind: type) -> Table:
    """Columns of all line references of all ticks."""
    flat = [line for those in lines for line in those]
    return {
        "tick": np.repeat(np.arange(len(lines)), [len(those) for those in lines]),
        "rho": np.array([line.rho for line in flat], kind),
        "theta": np.array([line.theta for line in flat], kind),
        "role": np.array([line.role for line in flat], str),
    }


def references_of(table: Table, ticks: int) -> list[tuple[LineReference, ...]]:
    """The line references of every tick."""
    lines: list[list[LineReference]] = [[] for _ in range(ticks)]
    for tick, rho, theta, role in zip(table["tick"], table["rho"], table["theta"], table["role"], strict=True):
        lines[tick].append(LineReference(rho=float(rho), theta=float(theta), role=str(role)))
    return [tuple(those) for those in lines]


def feature_table(frames: Sequence[FeatureFrame | None], kind: type) -> Table:
    """Columns of the feature frames; `tick` says at which tick each came, lines count the frames."""
    ticks = [tick for tick, frame in enumerate(frames) if frame is not None]
    present = [frame for frame in frames if frame is not None]
    return {
        "tick": np.array(ticks, np.int64),
        "stamp_ns": np.array([frame.stamp_ns for frame in present], np.int64),
        "plane": vectors([frame.plane for frame in present], 4, kind),
        "velocity": vectors([frame.velocity for frame in present], 3, kind),
        "velocity_covariance": vectors([frame.velocity_covariance for frame in present], 9, kind),
        "velocity_stamp_ns": np.array([frame.velocity_stamp_ns for frame in present], np.int64),
    } | with_prefix("line_", line_table([frame.lines for frame in present], kind))


def features_of(table: Table) -> dict[int, FeatureFrame]:
    """The feature frames by tick."""
    lines = lines_of(part(table, "line_"), len(table["tick"]))
    frames = {}
    for index, tick in enumerate(table["tick"].tolist()):
        plane, covariance = vector(table["plane"][index]), vector(table["velocity_covariance"][index])
        frames[tick] = FeatureFrame(
            lines=lines[index],
            plane=None if plane is None else tuple(plane.tolist()),
            stamp_ns=int(table["stamp_ns"][index]),
            velocity=vector(table["velocity"][index]),
            velocity_covariance=None if covariance is None else covariance.reshape(3, 3),
            velocity_stamp_ns=int(table["velocity_stamp_ns"][index]),
        )
    return frames
