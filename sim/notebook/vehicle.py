"""Notebook 04: actuation in level flight at a wall and after the loss of a rotor, choice of a design."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from dataclasses import dataclass, field

import numpy as np
import polars as pl
from scipy.optimize import lsq_linear

from allocation import (
    PushReach,
    RotorGeometry,
    WrenchFacets,
    control_effectiveness,
    hover_wrench,
    push_direction,
    push_reach,
    worst_push_reach,
)
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.sensors.cameras.outline import clip_polygon

#: Density of the air at sea level and 15 degrees [kg/m^3] (ISO 2533).
AIR_DENSITY = 1.225
#: Directions in which a tip slides, in B.
TRAVELS = {"up": (0.0, 0.0, -1.0), "sideways": (0.0, 1.0, 0.0), "down": (0.0, 0.0, 1.0)}
#: Unit wrenches [Fx Fy Fz Mx My Mz].
FRONT, RIGHT, DOWN, ROLL, PITCH, YAW = np.eye(6)
#: Half size of the square that a cut starts from [N, N m], and area below which a cut is empty.
LARGEST, EMPTY_AREA = 1e4, 1e-6
#: Weight of the kept over the minimised quantities after the loss of a rotor, and its largest residual [N, N m].
KEEP_WEIGHT, KEPT = 1e4, 1e-2

_facets = functools.lru_cache(maxsize=64)(WrenchFacets)


@dataclass(frozen=True, kw_only=True)
class Case:
    """A vehicle and the state of its rotors."""

    vehicle: VehicleParams = field(default_factory=VehicleParams)  # mass, geometry, limits, tip
    weak_rotor: str = ""  # name of a rotor with less thrust; empty without one
    fraction: float = 1.0  # part of its full thrust that remains; 0 is a lost rotor

    @property
    def geometry(self) -> RotorGeometry:
        """Geometry of the rotors."""
        return self.vehicle.geometry

    @property
    def weight_n(self) -> float:
        """Weight [N]."""
        return self.vehicle.mass_kg * GRAVITY

    @property
    def lower(self) -> np.ndarray:
        """Smallest thrusts [N], (n,): idle, or zero for a lost rotor."""
        return np.minimum(self.vehicle.thrust_min, self.upper)

    @property
    def upper(self) -> np.ndarray:
        """Largest thrusts [N], (n,)."""
        weak = np.array([name == self.weak_rotor for name in self.geometry.names])
        return np.where(weak, self.fraction, 1.0) * self.vehicle.thrust_max

    @property
    def matrix(self) -> np.ndarray:
        """Control effectiveness B, (6, n)."""
        return control_effectiveness(self.geometry)

    def reach(self, friction: float = 0.0, travel: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> PushReach:
        """Push of a tip that slides along `travel` under a Coulomb coefficient; at rest by default."""
        return push_reach(*self._limits, friction=friction, travel=np.array(travel))

    def worst_reach(self, friction: float) -> PushReach:
        """Push of a tip that may slide in any direction."""
        return worst_push_reach(*self._limits, friction=friction)

    @property
    def _limits(self) -> tuple[WrenchFacets, float, np.ndarray, np.ndarray, np.ndarray]:
        return _facets(self.geometry), self.weight_n, np.array(self.vehicle.tip_position_m), self.lower, self.upper

    def push_thrusts(self, push_n: float) -> np.ndarray:
        """Least-squares thrusts of a static push in level flight; the limits are not applied [N], (n,)."""
        wrench = hover_wrench(self.weight_n) + push_n * push_direction(np.array(self.vehicle.tip_position_m))
        return np.linalg.pinv(self.matrix) @ wrench

    @property
    def hover_power_w(self) -> float:
        r"""Ideal induced power of level hover, :math:`\sum T_i^{3/2} / \sqrt{2 \rho A}` (momentum theory) [W]."""
        disc = np.pi * self.vehicle.propeller_radius_m**2
        return float((np.maximum(self.push_thrusts(0.0), 0.0) ** 1.5).sum() / np.sqrt(2.0 * AIR_DENSITY * disc))

    @property
    def level_force_n(self) -> float:
        r"""Horizontal force possible in every direction [N]; NaN where level hover is impossible.

        It is the radius of the largest disc about zero in the level cut: the least distance of zero to a facet.
        """
        facets = _facets(self.geometry)
        low, high = facets.rooms(hover_wrench(self.weight_n), self.lower, self.upper)
        room, slopes = np.minimum(-low, high), np.linalg.norm(facets.normals[:, :2], axis=1)
        return float((room / np.maximum(slopes, 1e-12)).min()) if room.min() >= 0.0 else math.nan

    def cut(self, origin: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        r"""Corners of all (a, b) for which the wrench :math:`w_0 + a\,d_1 + b\,d_2` is attainable.

        With six rotors a wrench has unique thrusts :math:`u = B^{-1} w`, so each thrust limit is a half-plane in
        (a, b). A large square is clipped with each in sequence.

        Args:
            origin: Wrench w_0, (6,) [N, N m].
            first: Direction d_1, (6,).
            second: Direction d_2, (6,).

        Returns:
            Corners in order around the polygon, (k, 2); (0, 2) when its area is zero.
        """
        inverse = np.linalg.inv(self.matrix)
        at, slopes = inverse @ origin, inverse @ np.column_stack((first, second))
        rooms = np.concatenate((self.upper - at, at - self.lower))
        corners = LARGEST * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        for slope, room in zip(np.vstack((slopes, -slopes)), rooms, strict=True):
            corners = clip_polygon(corners, -slope, room)
        x, y = corners.T
        area = 0.5 * abs(x @ np.roll(y, 1) - y @ np.roll(x, 1))
        return corners if area > EMPTY_AREA else np.empty((0, 2))

    def level_cut(self) -> np.ndarray:
        """Corners of the horizontal forces (right, front) [N] in level flight without moment, (k, 2)."""
        return self.cut(hover_wrench(self.weight_n), RIGHT, FRONT)


def vehicle_case(weak_rotor: str = "", fraction: float = 1.0, tilt_deg: float | None = None, **changes: object) -> Case:
    """The Tarot T960 with other values.

    Args:
        weak_rotor: Rotor with less thrust.
        fraction: Part of its full thrust that remains.
        tilt_deg: Sideways tilt of the rotors.
        changes: Fields of `VehicleParams`.

    Raises:
        ConfigError: When a value is out of its range.
    """
    if tilt_deg is not None:
        changes["geometry"] = dataclasses.replace(VehicleParams().geometry, tilt_deg=tilt_deg)
    vehicle = dataclasses.replace(VehicleParams(), **changes)  # type: ignore[arg-type]
    return Case(vehicle=vehicle, weak_rotor=weak_rotor, fraction=fraction)


def abilities(case: Case, friction: float) -> dict[str, float]:
    """Figures of level flight by name with unit; NaN where not even hover is possible."""
    still = case.reach()
    return {
        "hover thrust of full thrust [%]": 100.0 * float(np.mean(case.push_thrusts(0.0) / case.vehicle.thrust_max)),
        "ideal hover power [W]": case.hover_power_w,
        "greatest push, standing still [N]": still.push,
        "least push that can be held [N]": still.least,
        **{f"greatest push, sliding {name} [N]": case.reach(friction, way).push for name, way in TRAVELS.items()},
        "greatest push, any travel [N]": case.worst_reach(friction).push,
        "horizontal force in every direction [N]": case.level_force_n,
    }


def after_loss(case: Case) -> tuple[float, float, float]:
    """Cost of level flight without roll and pitch moment after the loss of a rotor; NaN where it is impossible.

    Returns:
        Least horizontal force without yaw moment [N], the lean that balances this force [deg], and the least yaw
        moment without horizontal force [N m].
    """
    free = case.upper > case.lower
    matrix, weight = case.matrix[:, free], np.array([-case.weight_n, 0.0, 0.0])

    def least(minimised: list[int], kept: list[int]) -> float:
        rows, target = matrix[[2, 3, 4, *kept]], np.append(weight, np.zeros(len(kept)))
        found = lsq_linear(
            np.vstack((matrix[minimised], KEEP_WEIGHT * rows)),
            np.append(np.zeros(len(minimised)), KEEP_WEIGHT * target),
            bounds=(case.lower[free], case.upper[free]),
            tol=1e-14,
        ).x
        return float(np.linalg.norm(matrix[minimised] @ found)) if abs(rows @ found - target).max() < KEPT else math.nan

    force = least([0, 1], [5])
    return force, math.degrees(math.atan2(force, case.weight_n)), least([5], [0, 1])


@dataclass(frozen=True, kw_only=True)
class Duties:
    """Required abilities in level flight."""

    push_n: float = 10.0  # push standing still [N]
    sliding_push_n: float = 5.0  # push for any travel of the tip [N]
    friction: float = 0.6  # Coulomb coefficient of tip and wall [-]
    gust_n: float = 10.0  # horizontal force from any side, in free flight [N]
    least_mass_kg: float = 5.5  # frame, battery and tools; the rest is ballast


def design_map(duties: Duties, tilts_deg: np.ndarray, masses_kg: np.ndarray) -> pl.DataFrame:
    """Figures of every tilt and all-up mass; NaN where level hover is impossible.

    Returns:
        Rows by tilt, then mass: ``tilt_deg``, ``mass_kg``, ``push_n``, ``sliding_n`` (push for any travel), ``gust_n``,
        ``power_w`` of hover, and ``margin``, the relative margin of the tightest duty, negative where one is not met.
    """
    rows = []
    for tilt, mass in itertools.product(tilts_deg.tolist(), masses_kg.tolist()):
        case = vehicle_case(mass_kg=mass, tilt_deg=tilt)
        sliding = case.worst_reach(duties.friction).push
        rows.append((tilt, mass, case.reach().push, sliding, case.level_force_n, case.hover_power_w))
    designs = pl.DataFrame(rows, ["tilt_deg", "mass_kg", "push_n", "sliding_n", "gust_n", "power_w"], orient="row")
    required = {"push_n": duties.push_n, "sliding_n": duties.sliding_push_n, "gust_n": duties.gust_n}
    margins = [pl.col(name).fill_nan(-1.0) / max(least, 1e-9) - 1.0 for name, least in required.items()]
    return designs.with_columns(
        pl.min_horizontal(*margins, pl.col("mass_kg") / duties.least_mass_kg - 1.0).alias("margin")
    )


def cheapest(designs: pl.DataFrame) -> Case | None:
    """The design that meets all duties with the least hover power; None without one on the map."""
    best = designs.filter(pl.col("margin") >= 0.0).sort("power_w").head(1).to_dicts()
    return vehicle_case(mass_kg=best[0]["mass_kg"], tilt_deg=best[0]["tilt_deg"]) if best else None
