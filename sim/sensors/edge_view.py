"""Projection of the straight board edges into the camera, as CasADi functions."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import casadi as ca

from ibvs_qp.frames import rotate, rotate_back, rotation_rows

#: Least visible depth [m].
NEAR_M = 0.05
#: Shortest visible piece that counts as a line, normalised (31 px at 640x480).
SHORTEST = 0.05
#: A smaller change of depth or offset along an edge counts as none [m].
_PARALLEL = 1e-12
#: Numbers of a projected edge: visible or not, ends of its visible part (x1, y1, x2, y2), rho, theta, and the side of
#: the given surface point (> 0: the side of the normal); all normalised.
EDGE_NUMBERS = 8
#: Corners at the ends of every board edge, and whether it is upright: bottom left 0, bottom right 1, top right 2, top
#: left 3; the fifth point lies on the surface.
BOARD_EDGES = {"bottom": (0, 1, False), "right": (1, 2, True), "top": (3, 2, False), "left": (0, 3, True)}
#: Length of the outline, the view of the board, and where its parts lie: camera coordinates of the board's corner [m],
#: their change per metre along and up, the board's plane (a, b, c), the board's edges.
OUTLINE, BOARD_VIEW = 5, 12 + EDGE_NUMBERS * len(BOARD_EDGES)
CORNER, PER_METRE, PLANE = slice(0, 3), slice(3, 9), slice(9, 12)

_Numbers = Sequence[Any]


def _seen_edge(ends: tuple[_Numbers, _Numbers], surface: _Numbers, half_view: _Numbers, upright: Any) -> list[Any]:
    """`EDGE_NUMBERS` of an edge from its ends and a point of the surface in camera coordinates [m], as symbols.

    Args:
        ends: Its two end points.
        surface: A point beside it.
        half_view: Half the field of view to the right and down, normalised, (2,).
        upright: Whether its normal is the one that points right rather than down.
    """
    (x0, y0, z0), (x1, y1, z1) = ends
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    right, down = half_view
    low, high, seen = ca.SX(0.0), ca.SX(1.0), ca.SX(1.0)
    for value, rate in (
        (z0 - NEAR_M, dz),
        (right * z0 + x0, right * dz + dx),
        (right * z0 - x0, right * dz - dx),
        (down * z0 + y0, down * dz + dy),
        (down * z0 - y0, down * dz - dy),
    ):
        meets = -value / rate
        low = ca.if_else(rate >= _PARALLEL, ca.fmax(low, meets), low)
        high = ca.if_else(rate <= -_PARALLEL, ca.fmin(high, meets), high)
        seen = ca.logic_and(seen, ca.logic_or(ca.fabs(rate) >= _PARALLEL, value >= 0.0))
    near, far = z0 + low * dz, z0 + high * dz
    x1, y1, x2, y2 = (x0 + low * dx) / near, (y0 + low * dy) / near, (x0 + high * dx) / far, (y0 + high * dy) / far
    long = (x2 - x1) * (x2 - x1) + (y2 - y1) * (y2 - y1) >= SHORTEST * SHORTEST
    seen = ca.logic_and(seen, ca.logic_and(low < high, long))
    theta = ca.atan2(x1 - x2, y2 - y1)
    rho = x1 * ca.cos(theta) + y1 * ca.sin(theta)
    # The sign whose normal agrees with the reference, as in `ibvs_qp.frames.align_line`.
    reference = 0.0 if upright else 0.5 * math.pi
    error = ca.remainder(theta - reference, 2.0 * math.pi)
    turn = ca.fabs(error) > 0.5 * math.pi
    rho, error = ca.if_else(turn, -rho, rho), ca.if_else(turn, ca.remainder(error - math.pi, 2.0 * math.pi), error)
    theta = reference + error
    x, y, z = surface
    side = x * ca.cos(theta) + y * ca.sin(theta) - rho * z  # times the point's depth, which is positive
    return [seen, x1, y1, x2, y2, rho, theta, side]


def _entries(symbol: ca.SX) -> list[Any]:
    return [symbol[index] for index in range(symbol.numel())]


def _rows(symbol: ca.SX, count: int) -> list[list[Any]]:
    return [_entries(symbol[3 * row : 3 * row + 3]) for row in range(count)]


@functools.cache
def board_view() -> ca.Function:
    """Function of (position, quaternion, camera, outline, unit, half view) yielding `BOARD_VIEW` numbers.

    Position (3) [m] and quaternion (4) of B in I, the camera's place in B (3) [m], the board's four corners and its
    middle in the world (15) [m], the points (0, 0), (1, 0) and (0, 1) of the board (along, up) there (9) [m], and half
    the field of view (2).
    """
    position, quaternion, camera = ca.SX.sym("position", 3), ca.SX.sym("quaternion", 4), ca.SX.sym("camera", 3)
    outline, unit, half = ca.SX.sym("outline", 3 * OUTLINE), ca.SX.sym("unit", 9), ca.SX.sym("half", 2)
    rotation = rotation_rows(*_entries(quaternion))
    centre = [a + b for a, b in zip(_entries(position), rotate(rotation, _entries(camera)), strict=True)]

    def seen(point: _Numbers) -> tuple[Any, Any, Any]:
        ahead, right, down = rotate_back(rotation, [a - b for a, b in zip(point, centre, strict=True)])
        return right, down, ahead

    spots = [seen(point) for point in _rows(outline, OUTLINE)]
    corner, along, up = (seen(point) for point in _rows(unit, 3))
    per_metre = [a - b for spot in (along, up) for a, b in zip(spot, corner, strict=True)]
    ahead, right, down = (entry / -centre[0] for entry in rotation[0])  # the plane x = 0
    half_view = half[0], half[1]
    edges = [
        number
        for start, end, upright in BOARD_EDGES.values()
        for number in _seen_edge((spots[start], spots[end]), spots[-1], half_view, upright)
    ]
    numbers = ca.vertcat(*corner, *per_metre, right, down, ahead, *edges)
    return ca.Function("board_view", [position, quaternion, camera, outline, unit, half], [ca.densify(numbers)])


@functools.cache
def painted_edge_view(upright: bool) -> ca.Function:
    """Function of (board view, piece, half view) yielding `EDGE_NUMBERS` of an edge painted on the board.

    The piece is (along, up) of its two ends and of a point on the surface beside it [m], (6).
    """
    board, piece, half = ca.SX.sym("board", BOARD_VIEW), ca.SX.sym("piece", 6), ca.SX.sym("half", 2)
    corner, along, up = _rows(board, 3)

    def spot(index: int) -> list[Any]:
        right, high = piece[2 * index], piece[2 * index + 1]
        return [c + right * a + high * u for c, a, u in zip(corner, along, up, strict=True)]

    numbers = ca.vertcat(*_seen_edge((spot(0), spot(1)), spot(2), (half[0], half[1]), upright))
    return ca.Function("painted_edge_view", [board, piece, half], [ca.densify(numbers)])
