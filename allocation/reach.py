r"""Greatest push at a contact tip: level flight, weight carried, no moment left over, friction along the travel.

A tip at p that pushes with f along n and slides along the unit direction t feels the wall's normal force and the
friction that opposes the travel. The rotors must make

.. math:: w(f) = w_0 + f \begin{bmatrix} d \\ p \times d \end{bmatrix}, \quad d = n + \mu t,

with w_0 the wrench of hover (the weight). Standing still d = n. Sliding sideways costs twice: the lateral
force itself, and the yaw moment at the long lever of the tip. That is why the reach falls so fast with friction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from allocation.geometry import RotorGeometry
from allocation.hover import hover_wrench
from allocation.wrench_facets import ON_PLANE, Limit, WrenchFacets, crossings

Vector = tuple[float, float, float]
#: Tip direction of a vehicle that faces its wall: body front.
FRONT: Vector = (1.0, 0.0, 0.0)
#: Travel in the wall plane below this counts as standing still; any unit.
_STILL = 1e-12
#: Planes that the push meets within this distance are active together [N].
_SAME_PLANE = 1e-7
#: Directions of travel that are tried, and steps of the linearisation [-]: the third changes less than 0.01 N.
TRAVELS, STEPS = 48, 3


@dataclass(frozen=True, kw_only=True)
class PushReach:
    """Range of possible pushes, and the thrust limits that end it.

    Attributes:
        push: Greatest push [N]; NaN when no push, not even zero, is possible.
        least: Smallest possible push [N]: 0, or more where only pushing relieves a weak rotor; NaN likewise.
        binding: Rotors at a limit at the greatest push: pairs of index and "lower" or "upper".
    """

    push: float
    least: float
    binding: tuple[tuple[int, str], ...]


def push_direction(
    tip: np.ndarray, friction: float = 0.0, travel: np.ndarray | None = None, normal: np.ndarray | Vector = FRONT
) -> np.ndarray:
    """Wrench that the rotors must add per newton of push, (6,).

    Args:
        tip: Contact point in B [m], (3,).
        friction: Coulomb coefficient of tip and wall [-].
        travel: Direction in which the tip slides, in B, (3,), any length; its component along the normal has no
            effect. None or zero when it stands still.
        normal: Unit vector into the wall, in B, (3,).
    """
    into = np.asarray(normal, float)
    force = into.copy()
    if travel is not None:
        along = np.asarray(travel, float) - into * float(into @ np.asarray(travel, float))
        length = math.sqrt(float(along @ along))
        if length > _STILL:
            force = force + (friction / length) * along
    return np.concatenate((force, np.cross(np.asarray(tip, float), force)))


def push_reach(
    rotors: RotorGeometry | WrenchFacets,
    weight: float,
    tip: np.ndarray,
    lower: Limit,
    upper: Limit,
    *,
    friction: float = 0.0,
    travel: np.ndarray | None = None,
    normal: np.ndarray | Vector = FRONT,
) -> PushReach:
    """Greatest push at the tip in level flight, exact for any number of rotors.

    Args:
        rotors: The rotors; their `WrenchFacets` for repeated queries.
        weight: Weight to carry [N].
        tip: Contact point in B [m], (3,).
        lower: Smallest thrusts [N], (n,) or one number.
        upper: Largest thrusts [N], (n,) or one number; equal to lower for a dead rotor.
        friction: Coulomb coefficient [-].
        travel: Direction in which the tip slides, in B, (3,); None when it stands still.
        normal: Unit vector into the wall, in B, (3,).

    Raises:
        ValueError: When a lower limit is above its upper limit.
    """
    facets = rotors if isinstance(rotors, WrenchFacets) else WrenchFacets(rotors)
    return ray_reach(facets, hover_wrench(weight), push_direction(tip, friction, travel, normal), lower, upper)


def ray_reach(facets: WrenchFacets, wrench: np.ndarray, direction: np.ndarray, lower: Limit, upper: Limit) -> PushReach:
    """Greatest push on top of any steady wrench of the rotors; limits and Raises as of `push_reach`.

    Args:
        facets: Of the rotors.
        wrench: Wrench of the rotors without push [N, N m], (6,).
        direction: Wrench per newton of push, by `push_direction`, (6,).
        lower: Smallest thrusts.
        upper: Largest thrusts.
    """
    return _reach(facets, *facets.rooms(wrench, lower, upper), facets.normals @ direction)


def worst_push_reach(
    rotors: RotorGeometry | WrenchFacets,
    weight: float,
    tip: np.ndarray,
    lower: Limit,
    upper: Limit,
    *,
    friction: float,
    normal: np.ndarray | Vector = FRONT,
) -> PushReach:
    r"""Push that is possible in every direction of travel along the wall.

    In closed form: against a plane with normal y the worst travel raises :math:`y^T d` to
    :math:`y^T d_n + \mu \|(y^T d_1, y^T d_2)\|` with d_1, d_2 the directions of friction along two wall axes.

    Args and Raises: as `push_reach`.
    """
    facets = rotors if isinstance(rotors, WrenchFacets) else WrenchFacets(rotors)
    still = push_direction(tip, normal=normal)
    axes = np.linalg.svd(np.asarray(normal, float)[None, :])[2][1:]
    sliding = np.array([push_direction(tip, 1.0, axis, normal) - still for axis in axes])
    swing = friction * np.linalg.norm(facets.normals @ sliding.T, axis=1)
    slope = facets.normals @ still
    # A push that every travel allows lies between the planes at both ends of the swing.
    low, high = facets.rooms(hover_wrench(weight), lower, upper)
    return _reach(facets, np.tile(low, 2), np.tile(high, 2), np.concatenate((slope - swing, slope + swing)))


def _reach(facets: WrenchFacets, low: np.ndarray, high: np.ndarray, slope: np.ndarray) -> PushReach:
    """Interval of pushes between all pairs of planes, and the rotors at a limit at its upper end."""
    enter, leave = crossings(low, high, slope)
    least, greatest = max(float(enter.max()), 0.0), float(leave.min())
    if greatest < least - ON_PLANE:
        return PushReach(push=math.nan, least=math.nan, binding=())
    binding = set()
    for plane in np.flatnonzero(leave <= greatest + _SAME_PLANE):
        row = np.sign(slope[plane]) * facets.coefficients[plane % len(facets.normals)]
        binding |= {(int(rotor), "upper" if row[rotor] > 0.0 else "lower") for rotor in np.flatnonzero(row)}
    return PushReach(push=max(greatest, 0.0), least=least, binding=tuple(sorted(binding)))


def tilted_push_reach(
    facets: WrenchFacets,
    weight: float,
    tip: np.ndarray,
    lower: Limit,
    upper: Limit,
    *,
    tilt: float,
    friction: float = 0.0,
    travel: np.ndarray | None = None,
) -> tuple[float, np.ndarray]:
    r"""Greatest push against a wall straight ahead while roll and pitch may deviate from level.

    In level axes the rotors make the force :math:`F = f d - m g e_z` and the moment :math:`f p \times d`; in a body
    tilted by :math:`\theta` they change by :math:`F \times \theta` and :math:`f p \times (d \times \theta)`. A linear
    program finds f and :math:`\theta` with the f of the last step in these products. The push returned is exact at the
    angles returned.

    Args as of `push_reach`, the direction of travel in level axes, and ``tilt``, the largest roll and pitch [rad].

    Returns:
        Push [N], NaN when none is possible; and the roll and pitch that it takes [rad], (2,).
    """
    from scipy.optimize import linprog  # a second of import that flights do not need

    tip, level = np.asarray(tip, float), hover_wrench(weight)
    low, high = facets.rooms(level, lower, upper)
    direction, angles = push_direction(tip, friction, travel), np.zeros(2)
    push = ray_reach(facets, level, direction, lower, upper).push
    for _ in range(STEPS):
        force = (0.0 if math.isnan(push) else push) * direction[:3]
        turned = [np.cross(force + level[:3], axis) for axis in np.eye(3)[:2]]
        moments = [np.cross(tip, np.cross(force, axis)) for axis in np.eye(3)[:2]]
        columns = facets.normals @ np.vstack((np.transpose(turned), np.transpose(moments)))
        rows = np.column_stack((facets.normals @ direction, columns))
        found = linprog(
            (-1.0, 0.0, 0.0),
            A_ub=np.vstack((rows, -rows)),
            b_ub=np.concatenate((high, -low)),
            bounds=[(0.0, None), (-tilt, tilt), (-tilt, tilt)],
        )
        if found.status != 0:
            return math.nan, np.full(2, math.nan)
        angles = found.x[1:]
        (cr, cp), (sr, sp) = np.cos(angles), np.sin(angles)
        body = np.array([[cp, 0.0, -sp], [sr * sp, cr, sr * cp], [cr * sp, -sr, cr * cp]])  # level axes to B
        carried, force = np.concatenate((body @ level[:3], np.zeros(3))), body @ direction[:3]
        push = ray_reach(facets, carried, np.concatenate((force, np.cross(tip, force))), lower, upper).push
    return push, angles


def worst_tilted_push_reach(
    facets: WrenchFacets, weight: float, tip: np.ndarray, lower: Limit, upper: Limit, *, tilt: float, friction: float
) -> float:
    """Push that is possible in each of `TRAVELS` directions along the wall [N], or NaN; as `tilted_push_reach`."""
    angles = 2.0 * math.pi * np.arange(TRAVELS) / TRAVELS
    travels = np.column_stack((np.zeros(TRAVELS), np.cos(angles), np.sin(angles)))
    limits = facets, weight, tip, lower, upper
    pushes = [tilted_push_reach(*limits, tilt=tilt, friction=friction, travel=travel)[0] for travel in travels]
    return float(np.min(pushes))  # NaN if one is
