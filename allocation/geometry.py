"""Positions, thrust axes and spins of the rotors, the one source of every rotor number, and their wrench."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

#: Most rotors: the program grows with them, and a vehicle with more is a mistake.
MOST_ROTORS = 64
#: Error of the length of a given axis, which is then normalised: three digits suffice [-].
UNIT_TOLERANCE = 2e-3
#: Fraction of x in an axis beyond which a direction of the disc is found from y instead [-].
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


@dataclass(frozen=True, kw_only=True)
class RotorGeometry:
    """Rotors on a circle, each tilted sideways about its own arm (body frame FRD), unless a rotor states its own place.

    The thrust axis of a rotor at azimuth ``a`` with spin ``s`` and tilt ``t`` is
    ``(-s sin t sin a, s sin t cos a, -cos t)``: spin and tilt have the same sign, so the drag torque adds to
    the yaw moment of the tilt.

    Attributes:
        rotors: The rotors, in the order of every thrust vector.
        circle_radius_m: Distance of the rotor hubs from the centre of mass [m].
        tilt_deg: Sideways tilt of every thrust axis [deg].
        torque_ratio_m: Drag torque over thrust, KM of PX4, positive for a counter-clockwise rotor [m].
        hub_height_m: Height of the rotor hubs below the centre of mass, body z [m].
    """

    rotors: tuple[Rotor, ...]
    circle_radius_m: float = 0.0
    tilt_deg: float = 0.0
    torque_ratio_m: float
    hub_height_m: float = 0.0

    def __post_init__(self) -> None:
        """Refuse impossible geometries."""
        most = f"must be at most {LARGEST_M:g} m"
        on_circle = any(rotor.position_m is None for rotor in self.rotors)
        checks = (
            (1 <= len(self.rotors) <= MOST_ROTORS, f"rotors: {len(self.rotors)} given, 1 to {MOST_ROTORS} are needed"),
            (self.circle_radius_m > 0 or not on_circle, f"circle_radius_m: {self.circle_radius_m} m, must be > 0 m"),
            (abs(self.circle_radius_m) <= LARGEST_M, f"circle_radius_m: {self.circle_radius_m} m, {most}"),
            (abs(self.hub_height_m) <= LARGEST_M, f"hub_height_m: {self.hub_height_m} m, {most}"),
            (abs(self.tilt_deg) < 90, f"tilt_deg: {self.tilt_deg} deg, must lie within (-90, 90) deg"),
            (self.torque_ratio_m >= 0, f"torque_ratio_m: {self.torque_ratio_m} m, must be >= 0 m"),
            (self.torque_ratio_m <= LARGEST_M, f"torque_ratio_m: {self.torque_ratio_m} m, {most}"),
            (all(r.spin in (-1, 1) for r in self.rotors), "spin: every rotor needs +1 (CCW) or -1 (CW)"),
        )
        for good, message in checks:
            if not good:
                raise ValueError(message)

    @property
    def count(self) -> int:
        """Number of rotors."""
        return len(self.rotors)

    @property
    def names(self) -> tuple[str, ...]:
        """Rotor names in thrust order."""
        return tuple(rotor.name for rotor in self.rotors)

    @property
    def spins(self) -> np.ndarray:
        """Spin signs, shape (n,), +1 counter-clockwise seen from above."""
        return np.array([float(rotor.spin) for rotor in self.rotors])

    @property
    def torque_ratios(self) -> np.ndarray:
        """Drag torque over thrust of every rotor, shape (n,) [m]."""
        own = (rotor.torque_ratio_m for rotor in self.rotors)
        return np.array([self.torque_ratio_m if ratio is None else ratio for ratio in own])

    @property
    def positions(self) -> np.ndarray:
        """Hub positions in the body frame, shape (n, 3) [m]."""
        azimuth, height = self._azimuths, np.full(self.count, self.hub_height_m)
        circle = (self.circle_radius_m * np.cos(azimuth), self.circle_radius_m * np.sin(azimuth), height)
        return _replaced(np.column_stack(circle), [rotor.position_m for rotor in self.rotors])

    @property
    def axes(self) -> np.ndarray:
        """Unit thrust axes in the body frame, shape (n, 3)."""
        azimuth, tilt = self._azimuths, math.radians(self.tilt_deg)
        side = math.sin(tilt) * self.spins
        tilted = (-side * np.sin(azimuth), side * np.cos(azimuth), np.full(self.count, -math.cos(tilt)))
        return _replaced(np.column_stack(tilted), [rotor.axis and unit(rotor.axis) for rotor in self.rotors])

    @property
    def _azimuths(self) -> np.ndarray:
        return np.radians([rotor.azimuth_deg or 0.0 for rotor in self.rotors])


def _replaced(rows: np.ndarray, own: Sequence[Any]) -> np.ndarray:
    for row, vector in zip(rows, own, strict=True):
        if vector is not None:
            row[:] = vector
    return rows


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


def control_effectiveness(geometry: RotorGeometry) -> np.ndarray:
    r"""Wrench of unit thrust of every rotor, at the centre of mass in the body frame (FRD).

    Column i is :math:`[t_i;\; p_i \times t_i - s_i K_{M,i} t_i]` with hub position p, thrust axis t, spin s
    (+1 counter-clockwise) and drag-torque ratio K_M of the rotor, the convention of PX4's rotor effectiveness.

    Args:
        geometry: The rotors.

    Returns:
        Matrix B of shape (6, n): force rows [-], moment rows [m].
    """
    axes, positions = geometry.axes, geometry.positions
    moments = np.cross(positions, axes) - (geometry.spins * geometry.torque_ratios)[:, None] * axes
    return np.vstack((axes.T, moments.T))


def as_matrix(rotors: RotorGeometry | np.ndarray) -> np.ndarray:
    """Control effectiveness B of shape (6, n), of a geometry or given as such."""
    return control_effectiveness(rotors) if isinstance(rotors, RotorGeometry) else np.asarray(rotors, float)


CLOCKWISE, COUNTER_CLOCKWISE = -1, 1

#: Tarot T960 hexarotor with interleaved 30 degree tilt (paper, section II-A; rotor table of the group's mixer).
TAROT_T960 = RotorGeometry(
    rotors=(
        Rotor(name="mid_right", azimuth_deg=90.0, spin=CLOCKWISE),
        Rotor(name="mid_left", azimuth_deg=-90.0, spin=COUNTER_CLOCKWISE),
        Rotor(name="front_left", azimuth_deg=-30.0, spin=CLOCKWISE),
        Rotor(name="rear_right", azimuth_deg=150.0, spin=COUNTER_CLOCKWISE),
        Rotor(name="front_right", azimuth_deg=30.0, spin=COUNTER_CLOCKWISE),
        Rotor(name="rear_left", azimuth_deg=-150.0, spin=CLOCKWISE),
    ),
    circle_radius_m=0.48,
    tilt_deg=30.0,
    torque_ratio_m=0.020,
)
