"""A vehicle to be asked what it can do: mass, tilt, arm and, if wanted, one weak rotor."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass, field

import numpy as np

from allocation import WrenchFacets, control_effectiveness
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY

#: Density of the air [kg/m^3], sea level, 15 degrees (ISO 2533).
AIR_DENSITY = 1.225


@dataclass(frozen=True, kw_only=True)
class VehicleCase:
    """A vehicle and the state of its rotors.

    Attributes:
        vehicle: Mass, geometry, limits, tip.
        weak_rotor: Name of a rotor that gives less; empty if all are well.
        share: Part of its full thrust that it still gives; 0 stops it.
    """

    vehicle: VehicleParams = field(default_factory=VehicleParams)
    weak_rotor: str = ""
    share: float = 1.0

    @property
    def weight_n(self) -> float:
        """Weight [N]."""
        return self.vehicle.mass_kg * GRAVITY

    @property
    def tip(self) -> np.ndarray:
        """Brush tip in B [m], (3,)."""
        return np.array(self.vehicle.tip_position_m)

    @property
    def lower(self) -> np.ndarray:
        """Smallest thrusts [N], (n,): idle, or zero for a stopped rotor."""
        return np.minimum(self.vehicle.thrust_min, self.upper)

    @property
    def upper(self) -> np.ndarray:
        """Largest thrusts [N], (n,)."""
        weak = np.array([name == self.weak_rotor for name in self.vehicle.geometry.names])
        return np.where(weak, self.share, 1.0) * self.vehicle.thrust_max

    @functools.cached_property
    def matrix(self) -> np.ndarray:
        """Control effectiveness B, (6, n)."""
        return control_effectiveness(self.vehicle.geometry)

    @functools.cached_property
    def facets(self) -> WrenchFacets:
        """Facets of the attainable wrench set."""
        return WrenchFacets(self.matrix)

    @property
    def hover_thrusts(self) -> np.ndarray:
        """Thrusts of level hover if every rotor were well, least squares [N], (n,)."""
        return np.linalg.pinv(self.matrix) @ np.array([0.0, 0.0, -self.weight_n, 0.0, 0.0, 0.0])

    @property
    def hover_power_w(self) -> float:
        r"""Ideal induced power of level hover, :math:`\sum T_i^{3/2} / \sqrt{2 \rho A}` (momentum theory) [W]."""
        disc = np.pi * self.vehicle.propeller_radius_m**2
        return float((np.maximum(self.hover_thrusts, 0.0) ** 1.5).sum() / np.sqrt(2.0 * AIR_DENSITY * disc))

    def without_idle_floor(self) -> VehicleCase:
        """The same with rotors that may stop."""
        return dataclasses.replace(self, vehicle=dataclasses.replace(self.vehicle, thrust_min_n=0.0))


def vehicle_case(
    *,
    mass_kg: float | None = None,
    tilt_deg: float | None = None,
    tip_m: tuple[float, float, float] | None = None,
    weak_rotor: str = "",
    share: float = 1.0,
) -> VehicleCase:
    """The Tarot T960 with other values; None keeps its own.

    Args:
        mass_kg: All-up mass.
        tilt_deg: Sideways tilt of the rotors.
        tip_m: Brush tip in B.
        weak_rotor: Rotor that gives less.
        share: Part of its full thrust that it still gives.

    Raises:
        ConfigError: When a value is out of its range.
    """
    vehicle = VehicleParams()
    changes: dict[str, object] = {}
    if mass_kg is not None:
        changes["mass_kg"] = mass_kg
    if tip_m is not None:
        changes["tip_position_m"] = tip_m
    if tilt_deg is not None:
        changes["geometry"] = dataclasses.replace(vehicle.geometry, tilt_deg=tilt_deg)
    return VehicleCase(vehicle=dataclasses.replace(vehicle, **changes), weak_rotor=weak_rotor, share=share)  # type: ignore[arg-type]
