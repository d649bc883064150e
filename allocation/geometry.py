"""Positions, thrust axes and spins of the rotors: the one source of every rotor number."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Rotor:
    """One fixed rotor.

    Attributes:
        name: Readable name, unique in its geometry.
        azimuth_deg: Angle of the rotor arm from body +x towards the right (+y), seen from above [deg].
        spin: +1 if the propeller turns counter-clockwise seen from above, -1 if clockwise.
    """

    name: str
    azimuth_deg: float
    spin: int


@dataclass(frozen=True, kw_only=True)
class RotorGeometry:
    """Rotors on a circle, each tilted sideways about its own arm (body frame FRD).

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
    circle_radius_m: float
    tilt_deg: float
    torque_ratio_m: float
    hub_height_m: float = 0.0

    def __post_init__(self) -> None:
        """Refuse impossible geometries."""
        checks = (
            (len(self.rotors) >= 1, f"rotors: {len(self.rotors)} given, at least 1 is needed"),
            (self.circle_radius_m > 0, f"circle_radius_m: {self.circle_radius_m} m, must be > 0 m"),
            (abs(self.tilt_deg) < 90, f"tilt_deg: {self.tilt_deg} deg, must lie within (-90, 90) deg"),
            (self.torque_ratio_m >= 0, f"torque_ratio_m: {self.torque_ratio_m} m, must be >= 0 m"),
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
    def positions(self) -> np.ndarray:
        """Hub positions in the body frame, shape (n, 3) [m]."""
        azimuth = np.radians([rotor.azimuth_deg for rotor in self.rotors])
        height = np.full(self.count, self.hub_height_m)
        return np.column_stack((self.circle_radius_m * np.cos(azimuth), self.circle_radius_m * np.sin(azimuth), height))

    @property
    def axes(self) -> np.ndarray:
        """Unit thrust axes in the body frame, shape (n, 3)."""
        azimuth = np.radians([rotor.azimuth_deg for rotor in self.rotors])
        tilt, spin = math.radians(self.tilt_deg), self.spins
        side = math.sin(tilt) * spin
        return np.column_stack((-side * np.sin(azimuth), side * np.cos(azimuth), np.full(self.count, -math.cos(tilt))))


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
