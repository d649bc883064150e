"""Results of perception: invalid parts are dropped by name before a filter reads them."""

from __future__ import annotations

import dataclasses

import numpy as np

from ibvs_qp.measurement import HORIZONTAL, VERTICAL, FeatureFrame, LineFeature
from ibvs_qp.validation.fields import FEATURE_FRAME, plain_instance
from ibvs_qp.validation.geometry import VARIANCE_BOUND, read_line, read_lines, read_plane
from ibvs_qp.validation.numbers import matrix

_VELOCITY, _CURVATURE = FEATURE_FRAME.rows
#: Identities of the first line of each role without one; further ones count down by two. A given identity is positive.
_HORIZONTAL_ID, _VERTICAL_ID = -2, -3
#: Least eigenvalue of a covariance over the largest: below zero by rounding alone.
LEAST_EIGENVALUE = -1e-9


def check_features(features: FeatureFrame, most_lines: int, rejected: list[str]) -> FeatureFrame:
    """The features whose every number is plain, finite and within bounds; others are dropped.

    Args:
        features: With a sound stamp.
        most_lines: So many lines are looked at.
        rejected: Receives the names and reasons of dropped parts.
    """
    features = plain_instance(features, FeatureFrame)
    plane = None if features.plane is None else read_plane(features.plane)
    if plane is None and features.plane is not None:
        rejected.append("features.plane: not 4 finite values with D != 0 in front of the camera")
    lines = read_lines(features.lines, read_line, most_lines, "features.lines", rejected)
    if not all([line.track_id > 0 for line in lines]):
        lines = _identified(lines, rejected)
    if len({line.track_id for line in lines}) < len(lines):
        first = {line.track_id: line for line in reversed(lines)}
        rejected.append(f"features.lines: {len(lines) - len(first)} with a track_id of another line")
        lines = tuple(line for line in lines if first[line.track_id] is line)
    velocity, covariance = _velocity(features, rejected)
    return dataclasses.replace(
        features,
        lines=lines,
        plane=plane,
        velocity=velocity,
        velocity_covariance=covariance,
        curvature=_curvature(features, rejected),
    )


def _curvature(features: FeatureFrame, rejected: list[str]) -> np.ndarray | None:
    if features.curvature is None:
        return None
    entries = _CURVATURE.entries(features.curvature)
    if entries is None or not _CURVATURE.accepts(entries):
        rejected.append(f"features.{_CURVATURE.rejection(features.curvature)}")
        return None
    return np.array(entries)


def _identified(lines: tuple[LineFeature, ...], rejected: list[str]) -> tuple[LineFeature, ...]:
    """Lines whose track_id is 0, none, identified by their role and their order in the frame.

    Lines with a negative one are dropped: it may equal that of a line without one, or mark all lines of no track.
    """
    if negative := sum([line.track_id < 0 for line in lines]):
        rejected.append(f"features.lines: {negative} with a negative track_id")
        lines = tuple([line for line in lines if line.track_id >= 0])
    counts = {HORIZONTAL: _HORIZONTAL_ID, VERTICAL: _VERTICAL_ID}
    identified = []
    for line in lines:
        if line.track_id == 0:
            line, counts[line.role] = dataclasses.replace(line, track_id=counts[line.role]), counts[line.role] - 2
        identified.append(line)
    return tuple(identified)


def _velocity(features: FeatureFrame, rejected: list[str]) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Velocity and its covariance; None if one of them is missing."""
    if features.velocity is None:
        return None, None
    entries, covariance = _VELOCITY.entries(features.velocity), matrix(features.velocity_covariance, 3)
    if entries is None or not _VELOCITY.accepts(entries):
        rejected.append(f"features.{_VELOCITY.rejection(features.velocity)}")
    elif covariance is None or not _is_covariance(covariance):
        rejected.append("features.velocity_covariance: not 3 x 3, finite, symmetric and without negative variance")
    else:
        return np.array(entries), covariance.copy()
    return None, None


def _is_covariance(matrix: np.ndarray) -> bool:
    if not (np.abs(matrix) <= VARIANCE_BOUND).all() or not np.allclose(matrix, matrix.T):
        return False
    smallest, *_, largest = np.linalg.eigvalsh(matrix).tolist()
    return smallest >= LEAST_EIGENVALUE * largest
