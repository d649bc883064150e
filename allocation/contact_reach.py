r"""Greatest push at a contact tip: level flight, weight carried, no moment left over, friction along the travel.

A tip at p that pushes with f along n and slides along the unit direction t feels the wall's normal force and the
friction that opposes the travel. The rotors must make

.. math:: w(f) = w_0 + f \begin{bmatrix} d \\ p \times d \end{bmatrix}, \quad d = n + \mu t,

with w_0 the wrench that holds the vehicle (its weight). Standing still d = n. Sliding sideways costs twice: the lateral
force itself, and the yaw moment at the long lever of the tip. That is why the limit falls so fast with friction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from allocation.geometry import RotorGeometry
from allocation.wrench_facets import ON_PLANE, RELATIVE_ZERO, WrenchFacets, cut, cut_ends

#: Tip direction of a vehicle that faces its wall: body front.
FRONT = (1.0, 0.0, 0.0)
#: Travel in the wall plane below this counts as standing still; any unit.
_STILL = 1e-12
#: Planes this near to the one that binds bind as well [N].
_SAME_PLANE = 1e-7


@dataclass(frozen=True, kw_only=True)
class PushReach:
    """What push is possible, and what bounds it.

    Attributes:
        push: Greatest push [N]; NaN when no push, not even zero, can be held.
        least: Smallest push that can be held [N]: 0, or more where only pushing relieves a weak rotor; NaN likewise.
        binding: Rotors at a limit at the greatest push: pairs of index and "lower" or "upper".
    """

    push: float
    least: float
    binding: tuple[tuple[int, str], ...]


def push_direction(
    tip: np.ndarray,
    friction: float = 0.0,
    travel: np.ndarray | None = None,
    normal: np.ndarray | tuple[float, float, float] = FRONT,
) -> np.ndarray:
    """Wrench that the rotors must add per newton of push, (6,).

    Args:
        tip: Contact point in B [m], (3,).
        friction: Coulomb coefficient of tip and wall [-].
        travel: Direction in which the tip slides, in B, (3,), any length, its part along the normal is dropped;
            None or zero when it stands still.
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


def hover_wrench(weight: float) -> np.ndarray:
    """Wrench of the rotors that carries a weight [N] in level flight, (6,)."""
    return np.array([0.0, 0.0, -weight, 0.0, 0.0, 0.0])


def push_reach(
    rotors: RotorGeometry | WrenchFacets,
    weight: float,
    tip: np.ndarray,
    lower: np.ndarray | float,
    upper: np.ndarray | float,
    *,
    friction: float = 0.0,
    travel: np.ndarray | None = None,
    normal: np.ndarray | tuple[float, float, float] = FRONT,
) -> PushReach:
    """Greatest push at the tip in level flight, exact for any number of rotors.

    Args:
        rotors: The rotors; their `WrenchFacets` when asked often.
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
    low, high = _limits(facets, lower, upper)
    slope = facets.normals @ push_direction(tip, friction, travel, normal)
    return _reach(facets, *facets.rooms(hover_wrench(weight), low, high), slope)


def worst_push_reach(
    rotors: RotorGeometry | WrenchFacets,
    weight: float,
    tip: np.ndarray,
    lower: np.ndarray | float,
    upper: np.ndarray | float,
    *,
    friction: float,
    normal: np.ndarray | tuple[float, float, float] = FRONT,
) -> PushReach:
    r"""Push that can be held whichever way the tip slides along the wall.

    In closed form: against a plane with normal y the worst travel raises :math:`y^T d` to
    :math:`y^T d_n + \mu \|(y^T d_1, y^T d_2)\|` with d_1, d_2 the directions of friction along two wall axes.

    Args and Raises: as `push_reach`.
    """
    facets = rotors if isinstance(rotors, WrenchFacets) else WrenchFacets(rotors)
    low, high = _limits(facets, lower, upper)
    still = push_direction(tip, normal=normal)
    axes = np.linalg.svd(np.asarray(normal, float)[None, :])[2][1:]
    sliding = np.array([push_direction(tip, 1.0, axis, normal) - still for axis in axes])
    swing = friction * np.linalg.norm(facets.normals @ sliding.T, axis=1)
    slope = facets.normals @ still
    # A push that every travel allows lies between the planes at both ends of the swing.
    low_room, high_room = facets.rooms(hover_wrench(weight), low, high)
    twice = np.concatenate((slope - swing, slope + swing))
    return _reach(facets, np.tile(low_room, 2), np.tile(high_room, 2), twice)


def _limits(facets: WrenchFacets, lower: np.ndarray | float, upper: np.ndarray | float) -> tuple[np.ndarray, ...]:
    count = facets.matrix.shape[1]
    low, high = (np.broadcast_to(np.asarray(entry, float), (count,)) for entry in (lower, upper))
    if (low > high).any():
        raise ValueError(f"lower thrust limit {low.tolist()} N above the upper one {high.tolist()} N")
    return low, high


def _reach(facets: WrenchFacets, low: np.ndarray, high: np.ndarray, slope: np.ndarray) -> PushReach:
    least, greatest = cut(low, high, slope)
    if greatest < -ON_PLANE:
        return PushReach(push=math.nan, least=math.nan, binding=())
    ends = cut_ends(low, high, slope)
    assert ends is not None
    binding: set[tuple[int, str]] = set()
    for plane in np.flatnonzero(ends[1] <= greatest + _SAME_PLANE):
        side = 1 if slope[plane] > 0.0 else -1
        binding |= set(facets.binding(int(plane) % len(facets.normals), side))
    return PushReach(push=max(greatest, 0.0), least=max(least, 0.0), binding=tuple(sorted(binding)))


class PushReachTable:
    """The same question for one vehicle and tip, fast enough for every tick: load, direction and limits may change.

    One matrix product gives the room between every pair of planes and how fast the push uses it up; plain numbers do
    the rest: a few microseconds, for six rotors and for eight.

    Args:
        rotors: The rotors.
        tip: Contact point in B [m], (3,).
    """

    def __init__(self, rotors: RotorGeometry | WrenchFacets, tip: np.ndarray | tuple[float, float, float]) -> None:
        facets = rotors if isinstance(rotors, WrenchFacets) else WrenchFacets(rotors)
        normals, n, k = facets.normals, facets.matrix.shape[1], len(facets.normals)
        positive, negative = np.maximum(facets.shares, 0.0), np.minimum(facets.shares, 0.0)
        x, y, z = (float(entry) for entry in tip)
        lever = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        zero = np.zeros((k, 3))
        self._rows = np.block(
            [
                [-normals, zero, positive, negative],
                [-normals, zero, negative, positive],
                [np.zeros((k, 6)), normals[:, :3] + normals[:, 3:] @ lever, np.zeros((k, 2 * n))],
            ]
        )
        self._values = np.zeros(9 + 2 * n)
        self._rotors, self._planes = n, k

    def push(self, wrench: np.ndarray, force: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
        r"""Greatest push [N]; NaN when no push, not even zero, can be held.

        Args:
            wrench: Wrench of the rotors that holds the vehicle without contact, (6,) [N, N m].
            force: Force of the rotors per newton of push, :math:`n + \mu t`, in B, (3,).
            lower: Smallest thrusts, (n,) [N].
            upper: Largest thrusts, (n,) [N], not below lower.
        """
        values, n, k = self._values, self._rotors, self._planes
        values[:6] = wrench
        values[6:9] = force
        values[9 : 9 + n] = lower
        values[9 + n :] = upper
        rooms = (self._rows @ values).tolist()
        least, greatest = 0.0, math.inf
        for low, high, slope in zip(rooms[:k], rooms[k : 2 * k], rooms[2 * k :], strict=True):
            if -RELATIVE_ZERO < slope < RELATIVE_ZERO:
                if low > ON_PLANE or high < -ON_PLANE:
                    return math.nan
                continue
            enter, leave = (low / slope, high / slope) if slope > 0.0 else (high / slope, low / slope)
            if enter > least:
                least = enter
            if leave < greatest:
                greatest = leave
        return max(greatest, 0.0) if greatest >= least - ON_PLANE else math.nan
