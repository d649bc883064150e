"""Checks of lines and planes: accepted ones have plain numbers, converted if necessary."""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter, is_
from typing import Any, TypeVar

import numpy as np

from ibvs_qp.measurement import HORIZONTAL, VERTICAL, LineFeature, LineReference
from ibvs_qp.validation.clock import STAMP_END
from ibvs_qp.validation.numbers import FLOAT, attempt, matrix, number, text, vector, whole

#: Largest rho [-] and theta [rad].
LINE_BOUND = 1e6
#: Largest variance, of an unobserved quantity.
VARIANCE_BOUND = 1e12
#: Largest magnitude of a track's identity: logs and the C library hold 64 bits.
TRACK_BOUND = 2**63 - 1
#: Largest entry of a plane divided by D [1/m].
INVERSE_DEPTH_BOUND = 1e3
#: Smallest inverse depth of a plane on the optical axis [1/m]: 20 m.
INVERSE_DEPTH_MIN = 0.05

Line = TypeVar("Line")
Plane = tuple[float, float, float, float]

_values = attrgetter("rho", "theta", "weight", "role", "kind", "stamp_ns", "track_id", "surface_side", "covariance")
_PLAIN_PLANE = (float,) * 4
_PLAIN = (float, float, float, str, str, int, int, int, np.ndarray)


def read_lines(
    lines: Any, read: Callable[[Any], Line | None], most: int, name: str, rejected: list[str]
) -> tuple[Line, ...]:
    """The accepted ones of the first ``most`` lines or line references; the same tuple if it is plain.

    Args:
        lines: Any input of the caller.
        read: `read_line` or `read_line_reference`.
        most: Largest number of checked entries: a tick has a deadline.
        name: Of the input.
        rejected: Receives name and reason of refused ones.
    """
    if type(lines) not in (tuple, list):
        rejected.append(f"{name}: not a tuple of lines")
        return ()
    if len(lines) > most:
        rejected.append(f"{name}: {len(lines)} given, only the first {most} are looked at")
        lines = lines[:most]
    try:
        accepted = tuple(map(read, lines))
    except Exception:  # of a class of the caller's
        accepted = tuple([attempt(read, line) for line in lines])
    if type(lines) is tuple and all(map(is_, accepted, lines)) and None not in accepted:
        return lines
    good = tuple([line for line in accepted if line is not None])
    if faults := len(lines) - len(good):
        rejected.append(f"{name}: {faults} malformed, not finite or of unknown role")
    return good


def read_line(line: Any) -> LineFeature | None:
    """A `LineFeature` with plain numbers within bounds, or None; the same line if nothing has to be converted."""
    if not issubclass(type(line), LineFeature):
        return None
    values = _values(line)
    plain = type(line) is LineFeature and tuple(map(type, values)) == _PLAIN and values[-1].dtype == FLOAT
    if not plain or not _is_plain_segment(line.segment):
        line = _converted(line)
        if line is None:
            return None
        values = _values(line)
    rho, theta, weight, role, _, stamp, track, side, covariance = values
    if covariance.shape != (2, 2) or not (role == HORIZONTAL or role == VERTICAL):
        return None
    (a, b), (c, d) = covariance.tolist()
    good = (
        abs(rho) <= LINE_BOUND
        and abs(theta) <= LINE_BOUND
        and 0.0 <= weight <= 1.0
        and 0 <= stamp < STAMP_END
        and -TRACK_BOUND <= track <= TRACK_BOUND
        and -1 <= side <= 1
        and 0.0 <= a <= VARIANCE_BOUND
        and 0.0 <= d <= VARIANCE_BOUND
        and abs(b) + abs(c) <= VARIANCE_BOUND
        and (line.segment is None or all([abs(entry) <= LINE_BOUND for entry in line.segment.ravel().tolist()]))
    )
    return line if good else None


def _is_plain_segment(segment: Any) -> bool:
    return segment is None or (type(segment) is np.ndarray and segment.shape == (2, 2) and segment.dtype == FLOAT)


def _converted(line: LineFeature) -> LineFeature | None:
    """The line with plain numbers, in bounds or not; None where one is no number."""
    values = {
        "rho": number(line.rho),
        "theta": number(line.theta),
        "weight": number(line.weight),
        "covariance": matrix(line.covariance, 2),
        "role": text(line.role),
        "kind": text(line.kind),
        "stamp_ns": whole(line.stamp_ns, 0, STAMP_END - 1),
        "track_id": whole(line.track_id, -TRACK_BOUND, TRACK_BOUND),
        "surface_side": whole(line.surface_side, -1, 1),
    }
    if line.segment is not None:
        values["segment"] = matrix(line.segment, 2)
    return None if any([value is None for value in values.values()]) else LineFeature(**values)


def read_line_reference(line: Any) -> LineReference | None:
    """A `LineReference` with plain numbers within bounds and a known role, or None; the line itself if plain."""
    if not issubclass(type(line), LineReference):
        return None
    given = line.rho, line.theta, line.role
    rho, theta, role = number(given[0]), number(given[1]), text(given[2])
    if rho is None or theta is None or not (role == HORIZONTAL or role == VERTICAL):
        return None
    if not (abs(rho) <= LINE_BOUND and abs(theta) <= LINE_BOUND):
        return None
    plain = type(line) is LineReference and all(map(is_, (rho, theta, role), given))
    return line if plain else LineReference(rho=rho, theta=theta, role=role)


def read_plane(plane: Any) -> Plane | None:
    """A plane (A, B, C, D) in front of the camera with D != 0 as plain numbers, or None; the plane itself if plain."""
    plain = type(plane) is tuple and tuple(map(type, plane)) == _PLAIN_PLANE
    entries = plane if plain else vector(plane, 4)
    if entries is None or entries[3] == 0.0:
        return None
    a, b, c, d = entries
    bound = INVERSE_DEPTH_BOUND
    within = abs(a / d) < bound and abs(b / d) < bound and INVERSE_DEPTH_MIN < -c / d < bound
    return None if not within else plane if plain else (a, b, c, d)
