"""One rotor, and the plane of its disc."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

#: Error of the length of a given axis, which is then normalised: three digits suffice [-].
UNIT_TOLERANCE = 2e-3
#: Share of x in an axis beyond which a direction of the disc is found from y instead [-].
ALONG_X = 0.99
#: Largest length in a geometry [m]: ten times the largest vehicle that hovers; products of far larger ones overflow.
LARGEST_M = 100.0


@dataclass(frozen=True, kw_only=True)
class Rotor:
    """One fixed rotor: on the circle of its geometry by its azimuth, or with a position and an axis of its own.

    Attributes:
        name: Readable name, unique in its geometry.
        azimuth_deg: Angle of the rotor arm from body +x towards the right (+y), seen from above [deg].
        spin: +1 if the propeller turns counter-clockwise seen from above, -1 if clockwise.
        position_m: Hub in the body frame FRD [m], (3,); None on the circle.
        axis: Unit thrust axis in the body frame, (3,); None for the tilt of the geometry.
        torque_ratio_m: Drag torque over thrust [m]; None for the geometry's.
    """

    name: str
    azimuth_deg: float | None = None
    spin: int
    position_m: tuple[float, float, float] | None = None
    axis: tuple[float, float, float] | None = None
    torque_ratio_m: float | None = None

    def __post_init__(self) -> None:
        """Refuse impossible rotors."""
        place, axis, ratio = self.position_m, self.axis, self.torque_ratio_m
        length = 1.0 if axis is None else float(np.linalg.norm(axis))
        angle, most = self.azimuth_deg or 0.0, f"at most {LARGEST_M:g} m"
        checks = (
            (self.azimuth_deg is not None or bool(place and axis), "azimuth_deg, or position_m and axis, is needed"),
            (abs(angle) <= 360.0, f"azimuth_deg: {angle} deg, must lie in [-360, 360] deg"),
            (place is None or all(map(_near, place)), f"position_m: {place} m, must be finite, {most}"),
            (abs(length - 1.0) <= UNIT_TOLERANCE, f"axis: {axis} has the length {length:g}, must be a unit vector"),
            (ratio is None or 0 <= ratio <= LARGEST_M, f"torque_ratio_m: {ratio} m, must be >= 0 m, {most}"),
        )
        for good, message in checks:
            if not good:
                raise ValueError(f"{self.name}: {message}")


def _near(value: float) -> bool:
    return abs(value) <= LARGEST_M


def unit(vector: Sequence[float]) -> np.ndarray:
    """A vector divided by its length, (3,)."""
    return np.array(vector) / np.linalg.norm(vector)


def perpendicular(axis: np.ndarray) -> np.ndarray:
    """A unit vector in the plane of a propeller disc with this axis, (3,)."""
    side = np.cross(axis, [0.0, 1.0, 0.0] if abs(axis[0]) > ALONG_X else [1.0, 0.0, 0.0])
    return side / np.linalg.norm(side)


def disc_rim(axis: np.ndarray, radius: float, points: int) -> np.ndarray:
    """Points on the rim of a propeller disc, seen from its hub, (points, 3) [m]."""
    side = perpendicular(axis)
    angle = np.linspace(0.0, 2.0 * np.pi, points, endpoint=False)[:, None]
    return radius * (np.cos(angle) * side + np.sin(angle) * np.cross(axis, side))
