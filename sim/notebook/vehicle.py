"""Notebook 04: vehicle in level flight at a wall and after the loss of a rotor, choice of a design, their figures."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
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
from sim.figures.style import FAINT, REFERENCE, legend_below, new_figure
from sim.notebook.common import BLUE, GREEN, ORANGE
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


#: Length of the arrow of a rotor's sideways force, per unit of sin(tilt) [m].
_ARROW_M = 0.36
#: Tip positions: ahead of and below the centre of mass [m].
_LENGTHS_M, _HEIGHTS_M = (0.5, 0.7, 0.9), np.linspace(-0.3, 0.3, 25)


def draw_cuts(case: Case, nominal: Case) -> Figure:
    """Seen from above; level forces; forces in the vertical plane; push against yaw. Dashed: the nominal vehicle."""
    figure = new_figure(5.6)
    grid = figure.subplots(2, 2)
    _draw_vehicle(grid[0, 0], case)
    for axes, lift, x, y, labels, title in (
        (grid[0, 1], True, RIGHT, FRONT, ("force to the right [N]", "force to the front [N]"), "Level, lift = weight"),
        (grid[1, 0], False, FRONT, -DOWN, ("force to the front [N]", "lift [N]"), "No sideways force, no moment"),
        (grid[1, 1], True, YAW, FRONT, ("yaw moment [N m]", "force to the front [N]"), "Push and yaw share the thrust"),
    ):
        for each, style in (
            (nominal, {"facecolor": "none", "edgecolor": "#999999", "linestyle": "--"}),
            (case, {"facecolor": BLUE, "edgecolor": BLUE, "alpha": 0.3}),
        ):
            corners = each.cut(-each.weight_n * DOWN * lift, x, y)
            axes.fill(*corners.T, linewidth=1.0, **style)
            if not len(corners):
                message = "empty: level hover\nis out of reach"
                axes.text(0.5, 0.5, message, transform=axes.transAxes, ha="center", color=ORANGE)
        axes.set(xlabel=labels[0], ylabel=labels[1], title=title)
        if lift:
            axes.plot(0.0, 0.0, "+", color="#333333", markersize=7)
    grid[0, 1].set_aspect("equal", adjustable="datalim")
    grid[1, 0].axhline(case.weight_n, **REFERENCE)
    grid[1, 0].annotate("weight", (0.02, case.weight_n), xycoords=("axes fraction", "data"), va="bottom", fontsize=7)
    return figure


def _draw_vehicle(axes: Axes, case: Case) -> None:
    """Draw rotor discs, their sideways forces at equal thrust, and the arm, front up."""
    for name, hub, axis in zip(case.geometry.names, case.geometry.positions, case.geometry.axes, strict=True):
        colour = ORANGE if name == case.weak_rotor and case.fraction < 1.0 else BLUE
        place = (hub[1], hub[0])
        axes.add_patch(Circle(place, case.vehicle.propeller_radius_m, facecolor=colour, alpha=0.18, edgecolor=colour))
        axes.plot([0.0, hub[1]], [0.0, hub[0]], color=FAINT, linewidth=2.0, zorder=0)
        end = (hub[1] + _ARROW_M * axis[1], hub[0] + _ARROW_M * axis[0])
        axes.annotate("", end, place, arrowprops={"arrowstyle": "->", "color": colour, "linewidth": 1.2})
        axes.text(hub[1], hub[0] - 0.155, name.replace("_", " "), fontsize=6, ha="center", color="#555555")
    front, right, down = case.vehicle.tip_position_m
    axes.plot([0.0, right], [0.0, front], "o-", color="#333333", linewidth=2.0, markersize=4, markevery=[1])
    axes.text(right + 0.04, front, f"tip, {down:+.2f} m down" if down else "tip", fontsize=7, va="center")
    axes.set(xlabel="right [m]", ylabel="front [m]", title="From above", xlim=(-0.85, 0.85), ylim=(-0.75, 0.95))
    axes.set_aspect("equal")


def draw_thrusts(case: Case, push_n: float) -> Figure:
    """Thrusts of hover and of a static push, with the limits of every rotor."""
    figure = new_figure(2.6)
    axes = figure.subplots()
    places, push = np.arange(len(case.lower)), case.push_thrusts(push_n)
    outside = (push < case.lower - 1e-9) | (push > case.upper + 1e-9)
    label = f"push {push_n:g} N" + (", out of reach" if outside.any() else "")
    axes.bar(places - 0.2, case.push_thrusts(0.0), width=0.36, color=FAINT, label="hover")
    axes.bar(places + 0.2, push, width=0.36, color=np.where(outside, ORANGE, BLUE).tolist(), label=label)
    axes.hlines(case.lower, places - 0.42, places + 0.42, color="#333333", linewidth=1.0)
    axes.hlines(case.upper, places - 0.42, places + 0.42, color="#333333", linewidth=1.0, linestyle=":")
    axes.set_xticks(places, [name.replace("_", " ") for name in case.geometry.names])
    axes.set(ylabel="thrust [N]", title="Thrusts; full line: idle floor, dots: ceiling")
    axes.legend(loc="upper right", bbox_to_anchor=(1.0, 1.16), ncols=2)
    axes.grid(visible=False, axis="x")
    return figure


def draw_sliding(case: Case, frictions: Sequence[float], chosen: float) -> Figure:
    """Greatest push over the direction of travel in the view of the camera, per friction; the chosen one in colour."""
    figure = new_figure(3.5)
    axes = figure.add_subplot(projection="polar")
    azimuths = np.linspace(0.0, 2.0 * np.pi, 181)
    for friction in sorted({*frictions, chosen}):
        style = {"color": BLUE, "linewidth": 1.8} if friction == chosen else {"color": "#999999", "linewidth": 0.8}
        push = [case.reach(friction, (0.0, np.cos(a), -np.sin(a))).push for a in azimuths]
        axes.plot(azimuths, push, label=f"friction {friction:g}", **style)
        axes.annotate(f"{friction:g}", (azimuths[22], push[22]), fontsize=6.5, color=style["color"])
    axes.set_xticks(np.radians([0, 90, 180, 270]), ["right", "up", "left", "down"])
    axes.set_title("Greatest push [N] by travel of the tip; numbers: friction", pad=12)
    axes.set_rlabel_position(112.5)  # type: ignore[attr-defined]
    return figure


def draw_tip(case: Case, friction: float) -> Figure:
    """Push over the height of the tip, standing still and for any travel, for three arm lengths."""
    well = Case(vehicle=case.vehicle)
    figure = new_figure(2.7)
    grid = figure.subplots(1, 2, sharey=True)
    for length, shade in zip(_LENGTHS_M, (0.35, 0.65, 1.0), strict=True):
        tips = [_replaced(well, tip_position_m=(length, 0.0, float(height))) for height in _HEIGHTS_M]
        sliding = [tip.worst_reach(friction).push for tip in tips]
        grid[1].plot(1e2 * _HEIGHTS_M, sliding, color=BLUE, alpha=shade, label=f"tip {length:g} m ahead")
        if length == _LENGTHS_M[0]:
            grid[0].plot(1e2 * _HEIGHTS_M, [tip.reach().push for tip in tips], color=BLUE)
    for axes, title in zip(grid, ("Standing still (any length)", f"Any travel, friction {friction:g}"), strict=True):
        axes.axvline(1e2 * case.vehicle.tip_position_m[2], **REFERENCE)
        axes.set(xlabel="tip below the centre of mass [cm]", title=title)
    grid[0].set_ylabel("greatest push [N]")
    grid[0].set_ylim(bottom=0.0)
    grid[1].legend(fontsize=7)
    return figure


def _replaced(case: Case, **changes: object) -> Case:
    return dataclasses.replace(case, vehicle=dataclasses.replace(case.vehicle, **changes))  # type: ignore[arg-type]


def draw_weak_rotor(case: Case) -> Figure:
    """Pushes that can be held while one rotor has less thrust: a mid rotor, an outer rotor."""
    fractions = np.linspace(0.0, 1.0, 81)
    figure = new_figure(2.7)
    grid = figure.subplots(1, 2, sharey=True)
    for axes, rotor in zip(grid, ("mid_right", "front_right"), strict=True):
        cases = [Case(vehicle=case.vehicle, weak_rotor=rotor, fraction=float(each)) for each in fractions]
        least, greatest = np.array([(each.reach().least, each.reach().push) for each in cases]).T
        axes.fill_between(1e2 * fractions, least, greatest, color=BLUE, alpha=0.3, linewidth=0)
        axes.plot(1e2 * fractions, greatest, color=BLUE, label="greatest")
        axes.plot(1e2 * fractions, least, color=ORANGE, label="least")
        if case.weak_rotor and case.fraction < 1.0:
            axes.axvline(1e2 * case.fraction, **REFERENCE)
        axes.set(xlabel="full thrust that remains [%]", title=rotor.replace("_", " ") + " weak", xlim=(0, 100))
    grid[0].set_ylabel("push that can be held [N]")
    grid[1].legend(loc="lower right")
    return figure


def draw_design_map(designs: pl.DataFrame, duties: Duties, nominal: Case) -> Figure:
    """Hover power over mass and tilt, the border of every duty, the region that meets all, and its cheapest design."""
    figure = new_figure(3.9)
    axes = figure.subplots()
    shape = (designs["tilt_deg"].n_unique(), designs["mass_kg"].n_unique())
    maps = {name: designs[name].to_numpy().reshape(shape) for name in designs.columns}
    x, y = maps["mass_kg"], maps["tilt_deg"]
    axes.clabel(axes.contour(x, y, maps["power_w"], 12, colors="#bbbbbb", linewidths=0.7), fmt="%.0f W", fontsize=6)
    axes.contourf(x, y, maps["margin"], levels=[0.0, np.inf], colors=[BLUE], alpha=0.18)
    handles = []
    for values, bound, colour, label in (
        (maps["push_n"], duties.push_n, BLUE, f"push {duties.push_n:g} N, standing"),
        (maps["sliding_n"], duties.sliding_push_n, ORANGE, f"push {duties.sliding_push_n:g} N, any travel"),
        (maps["gust_n"], duties.gust_n, GREEN, f"{duties.gust_n:g} N from any side"),
    ):
        if np.nanmin(values) < bound < np.nanmax(values):
            axes.contour(x, y, np.nan_to_num(values), levels=[bound], colors=[colour], linewidths=1.4)
        handles.append(Line2D([], [], color=colour, label=label))
    label = f"least mass {duties.least_mass_kg:g} kg"
    handles.append(axes.axvline(duties.least_mass_kg, color="#333333", linewidth=1.0, label=label))
    place = (nominal.vehicle.mass_kg, nominal.geometry.tilt_deg)
    axes.plot(*place, "s", color="#333333", markersize=5)
    axes.annotate(" Tarot T960", place, fontsize=7, va="bottom")
    best = cheapest(designs)
    if best is not None:
        place = (best.vehicle.mass_kg, best.geometry.tilt_deg)
        axes.plot(*place, "*", color=ORANGE, markersize=13, zorder=5)
        axes.annotate(f"   cheapest: {best.hover_power_w:.0f} W", place, fontsize=7, va="top", color=ORANGE)
    axes.set(xlabel="all-up mass [kg]", ylabel="rotor tilt [deg]", title="Shaded: meets every duty; grey: hover power")
    axes.grid(visible=False)
    legend_below(figure, handles, fontsize=7)
    return figure
