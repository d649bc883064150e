"""Choosing a vehicle: every tilt and mass asked for the same duties, and the cheapest hover of those that meet them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allocation import WrenchFacets, hover_wrench, push_reach, worst_push_reach
from sim.notebook.ability.case import VehicleCase, vehicle_case

#: Slope of a facet that no horizontal force reaches.
_FLAT = 1e-12


@dataclass(frozen=True, kw_only=True)
class Duties:
    """What the vehicle shall be able to do in level flight.

    Attributes:
        push_n: Push standing still [N].
        sliding_push_n: Push whichever way the tip slides [N].
        friction: Coulomb coefficient of tip and wall [-].
        gust_n: Horizontal force from any side, in free flight [N].
        least_mass_kg: Frame, battery and tools; what is beyond it is ballast.
    """

    push_n: float = 10.0
    sliding_push_n: float = 5.0
    friction: float = 0.6
    gust_n: float = 10.0
    least_mass_kg: float = 5.5


@dataclass(frozen=True, kw_only=True)
class DesignMap:
    """Figures over tilt (rows) and mass (columns).

    Attributes:
        tilts_deg: (k,).
        masses_kg: (m,).
        push_n: Push standing still [N], (k, m); NaN where level hover is impossible.
        sliding_n: Push whichever way the tip slides [N], (k, m).
        gust_n: Horizontal force from any side [N], (k, m).
        power_w: Ideal hover power [W], (k, m).
    """

    tilts_deg: np.ndarray
    masses_kg: np.ndarray
    push_n: np.ndarray
    sliding_n: np.ndarray
    gust_n: np.ndarray
    power_w: np.ndarray

    def spare(self, duties: Duties) -> np.ndarray:
        """What is left of the tightest duty, as a share of it; negative where one is not met, (k, m)."""
        pairs = (
            (self.push_n, duties.push_n),
            (self.sliding_n, duties.sliding_push_n),
            (self.gust_n, duties.gust_n),
            (np.broadcast_to(self.masses_kg, self.push_n.shape), duties.least_mass_kg),
        )
        return np.min([np.nan_to_num(values / wanted, nan=0.0) - 1.0 for values, wanted in pairs], axis=0)

    def cheapest(self, duties: Duties) -> VehicleCase | None:
        """The design that meets all duties with the least hover power; None if there is none on the map."""
        meets = self.spare(duties) >= 0.0
        if not meets.any():
            return None
        tilt, mass = np.unravel_index(np.argmin(np.where(meets, self.power_w, np.inf)), meets.shape)
        return vehicle_case(mass_kg=float(self.masses_kg[mass]), tilt_deg=float(self.tilts_deg[tilt]))


def design_map(duties: Duties, tilts_deg: np.ndarray, masses_kg: np.ndarray) -> DesignMap:
    """Ask every tilt and mass.

    Args:
        duties: What is wanted.
        tilts_deg: Tilts of the rotors, (k,).
        masses_kg: All-up masses, (m,).
    """
    shape = (len(tilts_deg), len(masses_kg))
    push, sliding, gust, power = (np.full(shape, np.nan) for _ in range(4))
    for i, tilt in enumerate(tilts_deg):
        facets = vehicle_case(tilt_deg=float(tilt)).facets
        for j, mass in enumerate(masses_kg):
            case = vehicle_case(mass_kg=float(mass), tilt_deg=float(tilt))
            asked = (facets, case.weight_n, case.tip, case.lower, case.upper)
            push[i, j] = push_reach(*asked).push
            sliding[i, j] = worst_push_reach(*asked, friction=duties.friction).push
            gust[i, j] = _gust(case, facets)
            power[i, j] = case.hover_power_w
    return DesignMap(
        tilts_deg=tilts_deg, masses_kg=masses_kg, push_n=push, sliding_n=sliding, gust_n=gust, power_w=power
    )


def _gust(case: VehicleCase, facets: WrenchFacets) -> float:
    r"""Largest disc about zero in the level cut: least room over :math:`\|(y_x, y_y)\|` of a facet [N]."""
    low, high = facets.rooms(hover_wrench(case.weight_n), case.lower, case.upper)
    room, slopes = np.minimum(-low, high), np.linalg.norm(facets.normals[:, :2], axis=1)
    return float((room / np.maximum(slopes, _FLAT)).min()) if room.min() >= 0.0 else float("nan")
