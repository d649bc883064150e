"""What went into pilot and controller during a flight, tick by tick, in one file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ibvs_qp import Measurement, Reference, SensorFrame

from .pictures import picture_table, pictures_of
from .tables import (
    Table,
    feature_table,
    features_of,
    line_table,
    lines_of,
    part,
    reference_table,
    references_of,
    vector,
    vectors,
    with_prefix,
)

Limits = tuple[np.ndarray, np.ndarray]
#: Sensors resolve less; replayed is the rounded value, in double precision.
STORED = np.float32
_VECTORS = {"attitude": 4, "angular_velocity": 3, "specific_force": 3, "wrench": 6}
_MEASURED = {"contact_wrench": 6, "plane": 4, "velocity": 3, "velocity_covariance": 9}
_REFERENCE = ("push_force", "standoff", "velocity", "contact", "tilt", "travel")


@dataclass
class Recording:
    """Inputs of one flight, one entry per tick.

    Attributes:
        frames: As given to `Pilot.step`.
        thrust_limits: `Pilot.thrust_limits` before that step.
        measurements, references: As the pilot passed them to its controller.
    """

    frames: list[SensorFrame] = field(default_factory=list)
    thrust_limits: list[Limits | None] = field(default_factory=list)
    measurements: list[Measurement] = field(default_factory=list)
    references: list[Reference] = field(default_factory=list)


def save(recording: Recording, file: Path) -> None:
    """Write a recording; the inertial sensors and thrust limits of the measurements are those of the pilot."""
    frames, measured, wanted = recording.frames, recording.measurements, recording.references
    table: Table = {
        name: np.array([getattr(frame, name) for frame in frames], np.int64) for name in ("stamp_ns", "wrench_stamp_ns")
    }
    table |= {name: vectors([getattr(f, name) for f in frames], width, STORED) for name, width in _VECTORS.items()}
    rotors = max([len(limits[0]) for limits in recording.thrust_limits if limits is not None], default=1)
    for side, name in enumerate(("thrust_min", "thrust_max")):
        limits = [None if pair is None else pair[side] for pair in recording.thrust_limits]
        table[name] = vectors(limits, rotors, STORED)
    table |= with_prefix("image_", picture_table([frame.image for frame in frames]))
    table |= with_prefix("features_", feature_table([frame.features for frame in frames], STORED))
    for name, width in _MEASURED.items():
        table[f"measured_{name}"] = vectors([getattr(m, name) for m in measured], width, STORED)
    table["measured_plane_stamp_ns"] = np.array([m.plane_stamp_ns for m in measured], np.int64)
    table |= with_prefix("measured_line_", line_table([m.lines for m in measured], STORED))
    for name in _REFERENCE:
        values = np.array([getattr(reference, name) for reference in wanted])
        table[f"wanted_{name}"] = values if values.dtype == bool else values.astype(STORED)
    table |= with_prefix("wanted_line_", reference_table([reference.lines for reference in wanted], STORED))
    np.savez_compressed(file, **table)  # type: ignore[arg-type]


def load(file: Path) -> Recording:
    """Read a recording."""
    with np.load(file) as archive:
        table = dict(archive)
    stamps, wrench_stamps = table["stamp_ns"].tolist(), table["wrench_stamp_ns"].tolist()
    ticks = len(stamps)
    images, features = pictures_of(part(table, "image_")), features_of(part(table, "features_"))
    sensed = {name: table[name].astype(float) for name in _VECTORS}
    measured = {name: [vector(row) for row in table[f"measured_{name}"]] for name in _MEASURED}
    lines = lines_of(part(table, "measured_line_"), ticks)
    wanted = {name: table[f"wanted_{name}"] for name in _REFERENCE}
    wanted_lines = references_of(part(table, "wanted_line_"), ticks)
    recording = Recording()
    for tick in range(ticks):
        stamps_now = {"stamp_ns": stamps[tick], "wrench_stamp_ns": wrench_stamps[tick]}
        vectors_now = {name: rows[tick] for name, rows in sensed.items()}
        low, high = vector(table["thrust_min"][tick]), vector(table["thrust_max"][tick])
        recording.frames.append(
            SensorFrame(**stamps_now, **vectors_now, image=images.get(tick), features=features.get(tick))
        )
        recording.thrust_limits.append(None if low is None or high is None else (low, high))
        now = {name: values[tick] for name, values in measured.items()}
        plane, covariance = now["plane"], now["velocity_covariance"]
        now["plane"] = None if plane is None else tuple(plane.tolist())
        now["velocity_covariance"] = None if covariance is None else covariance.reshape(3, 3)
        vectors_now.pop("wrench")
        recording.measurements.append(
            Measurement(
                **stamps_now,
                **vectors_now,
                **now,
                lines=lines[tick],
                plane_stamp_ns=int(table["measured_plane_stamp_ns"][tick]),
                thrust_min=low,
                thrust_max=high,
            )
        )
        recording.references.append(
            Reference(
                push_force=float(wanted["push_force"][tick]),
                standoff=float(wanted["standoff"][tick]),
                lines=wanted_lines[tick],
                velocity=wanted["velocity"][tick].astype(float),
                contact=bool(wanted["contact"][tick]),
                travel=wanted["travel"][tick].astype(float),
                tilt=wanted["tilt"][tick].astype(float),
            )
        )
    return recording
