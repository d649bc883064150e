"""Sensor model of line perception: true lines projected and clipped, with noise and the camera's latency.

It replaces perception where the controller alone is studied (``--features geometric``). Of a real camera's errors, it
has the lost pictures and those of `sim.sensors.line_defects`.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import camera_twist_matrix
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, FeatureFrame
from ibvs_qp.pilot.painting.pattern import COLUMNS
from ibvs_qp.symbolic.function import BoundFunction
from sim.sensors.cameras.arm import vehicle_mask
from sim.sensors.cameras.exposure import Dropouts
from sim.sensors.cameras.protocol import Schedule, camera_intrinsics
from sim.sensors.cameras.timing import delivery_errors
from sim.sensors.edge_view import (
    BOARD_EDGES,
    BOARD_VIEW,
    EDGE_NUMBERS,
    PLANE,
    board_view,
    painted_edge_view,
)
from sim.sensors.line_defects import LineDefects
from sim.sensors.line_projection import moved_line, seen_line
from sim.sensors.painted_pieces import PaintedPieces
from sim.world.board import BoardGeometry
from sim.world.canvas import Canvas
from sim.world.painted_edges import PaintedEdges
from sim.world.random_streams import Normals, stream
from sim.world.scene import Scene

#: Noise of the plane: distance [m] and direction of the normal [rad].
SIGMA_DISTANCE_M, SIGMA_NORMAL = 0.001, math.radians(0.1)
#: Noise of the velocity per axis [m/s].
SIGMA_VELOCITY_M_S = 0.003
_VELOCITY_COVARIANCE = SIGMA_VELOCITY_M_S**2 * np.eye(3)
_VELOCITY_COVARIANCE.flags.writeable = False  # shared by all frames
#: Track identities: board edges by name, outer edges of strokes from `_FIRST_STROKE_TRACK`.
BOARD_TRACKS = {"bottom": 1, "right": 2, "top": 3, "left": 4}
_FIRST_STROKE_TRACK = 10
_BOARD_LINES = [
    (slice(start, start + EDGE_NUMBERS), VERTICAL if upright else HORIZONTAL, "board", BOARD_TRACKS[name])
    for start, (name, (*_, upright)) in zip(
        range(PLANE.stop, BOARD_VIEW, EDGE_NUMBERS), BOARD_EDGES.items(), strict=True
    )
]
#: A line without noise: its numbers, role, kind and track.
_Line = tuple[list[float], str, str, int]


class GeometricFeatures:
    """Sensor model of line perception: rate, latency, field of view and noise of a camera, but no pictures.

    Lines: the board's edges (kind "board") and the outer edges of the painted strokes where no later stroke and no
    brush covers them (kind "paint"; their surface side is the unpainted board).

    Attributes:
        curvature: Of the wall before the tip, as reported, or None.

    Args:
        scene: Board, paint job, camera, and ``features.sigma_vs``.
        vehicle: Where camera, arm and brush are.
        painted: The canvas, or the painted edges alone.
        seed: Seed of the noise.
        noise: Whether to add any noise at all.
    """

    def __init__(
        self,
        scene: Scene,
        vehicle: VehicleParams,
        painted: Canvas | PaintedEdges,
        seed: int,
        noise: bool = True,
    ) -> None:
        self.scene, self.vehicle, self._noise = scene, vehicle, noise
        self.curvature: np.ndarray | None = None
        self._edges = painted.edges if isinstance(painted, Canvas) else painted
        self._geometry = BoardGeometry(scene)
        self.intrinsics = camera_intrinsics(scene.camera)
        own, extra = np.random.SeedSequence([seed, 0xFEA7]).spawn(2)
        self._normals, self._extra = Normals(np.random.default_rng(own)), np.random.default_rng(extra)
        late = delivery_errors(scene.errors.timing, seed)
        self._schedule: Schedule[FeatureFrame] = Schedule(scene.camera.rate_hz, scene.camera.latency_s, late)
        self._dropouts = Dropouts(scene.errors.camera.dropped, stream(seed, "dropped pictures"))
        self._bind()
        self._defects = LineDefects(
            scene.errors.camera, scene.errors.depth, self.intrinsics[0], self._half, scene.camera.height
        )
        hidden = vehicle_mask(scene, vehicle, self.intrinsics)
        self._pieces = PaintedPieces(self._edges, self._board, self.intrinsics, hidden)

    def _bind(self) -> None:
        """Bind the compiled projection to the arrays that hold its arguments."""
        scene = self.scene
        half = 0.5 * np.array((scene.camera.width, scene.camera.height)) / self.intrinsics[:2]
        self._half = half.tolist()
        width, height = scene.board.width_m, scene.board.height_m
        corners = np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height), (0.5 * width, 0.5 * height)])
        outline = self._world(corners[:, 0], corners[:, 1]).reshape(-1)
        unit = self._world(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])).reshape(-1)
        self._position, self._quaternion, camera = np.zeros(3), np.zeros(4), np.array(self.vehicle.camera_position_m)
        self._board, self._piece, self._edge = np.zeros(BOARD_VIEW), np.zeros(6), np.zeros(EDGE_NUMBERS)
        self._view_board = BoundFunction(
            board_view(), (self._position, self._quaternion, camera, outline, unit, half), (self._board,)
        )
        self._view_piece = BoundFunction(
            painted_edge_view(self._geometry.pattern.kind == COLUMNS), (self._board, self._piece, half), (self._edge,)
        )

    def rests(self, now_ns: int) -> bool:
        """Whether neither a capture nor a delivery is due now, so that `tick` may be skipped."""
        return self._schedule.rests(now_ns)

    def tick(
        self,
        now_ns: int,
        position_ned: np.ndarray,
        quaternion_b_in_i: np.ndarray,
        velocity_body: np.ndarray,
        rate: np.ndarray | None = None,
    ) -> FeatureFrame | None:
        """Advance to ``now_ns``; the newest frame that has just become due, or None.

        Args:
            now_ns: Present time.
            position_ned: World position of the body frame's origin [m], (3,).
            quaternion_b_in_i: Attitude (w, x, y, z), (4,).
            velocity_body: True velocity of the centre of mass in B [m/s], (3,).
            rate: True angular velocity in B [rad/s], (3,), or None for zero.
        """
        if self._schedule.due(now_ns) and not self._dropouts.lost():
            stamp_ns = self._schedule.stamp(now_ns)
            self._schedule.push(now_ns, self.capture(position_ned, quaternion_b_in_i, velocity_body, stamp_ns, rate))
        return self._schedule.pop(now_ns)

    def capture(
        self,
        position_ned: np.ndarray,
        quaternion_b_in_i: np.ndarray,
        velocity_body: np.ndarray,
        stamp_ns: int,
        rate: np.ndarray | None = None,
    ) -> FeatureFrame:
        """Report of perception on a picture taken now; arguments as for `tick`."""
        self._position[:], self._quaternion[:] = position_ned, quaternion_b_in_i
        self._view_board()
        board = self._board.tolist()
        found = [(board[at], role, kind, track) for at, role, kind, track in _BOARD_LINES if board[at.start]]
        found += self._paint_lines()
        if self._defects.moves_lines:
            found = self._as_seen(found, board[PLANE], velocity_body, rate)
        a, b, c = self._plane(*board[PLANE])
        velocity = np.array(velocity_body, float)
        take = self._normals.take
        if self._noise:
            lines = [seen_line(*line, stamp_ns, take(2)) for line in found]
            velocity += SIGMA_VELOCITY_M_S * np.array(take(3))
        else:
            lines = [seen_line(*line, stamp_ns) for line in found]
        frame = FeatureFrame(
            lines=tuple(lines),
            plane=(a, b, c, -1.0),
            stamp_ns=stamp_ns,
            velocity=velocity,
            velocity_covariance=_VELOCITY_COVARIANCE,
            velocity_stamp_ns=stamp_ns,
            curvature=self.curvature,
        )
        return add_sigma_vs(frame, self.scene.features.sigma_vs, self._extra) if self._noise else frame

    def _as_seen(
        self, found: list[_Line], plane: list[float], velocity_body: np.ndarray, rate: np.ndarray | None
    ) -> list[_Line]:
        body = np.concatenate((velocity_body, np.zeros(3) if rate is None else rate))
        twist = (camera_twist_matrix(np.array(self.vehicle.camera_position_m)) @ body).tolist()
        line = self._defects.line
        return [(line(numbers, plane, twist), role, kind, track) for numbers, role, kind, track in found]

    def _world(self, along: np.ndarray, up: np.ndarray) -> np.ndarray:
        yz = self._geometry.point(along, up)
        return np.concatenate((np.zeros((*yz.shape[:-1], 1)), yz), axis=-1)

    def _paint_lines(self) -> list[_Line]:
        lines: list[_Line] = []
        for stroke, piece in self._pieces.seen():
            self._piece[:] = piece
            self._view_piece()
            numbers = self._edge.tolist()
            if numbers[0]:
                lines.append((numbers, self._geometry.pattern.guide_role, "paint", _FIRST_STROKE_TRACK + stroke))
        return lines

    def _plane(self, a: float, b: float, c: float) -> tuple[float, float, float]:
        if not self._noise:
            return a, b, c
        size = math.sqrt(a * a + b * b + c * c)
        x, y, z, distance = a / size, b / size, c / size, 1.0 / size
        i, j, k, far = self._normals.take(4)
        sigma_distance, sigma_normal = SIGMA_DISTANCE_M, SIGMA_NORMAL
        if self._defects.blurs_plane:
            more = self._defects.plane_sigmas(distance)
            sigma_distance, sigma_normal = math.hypot(sigma_distance, more[0]), math.hypot(sigma_normal, more[1])
        along = x * i + y * j + z * k  # a tilt leaves the length of the normal
        x, y, z = (n + sigma_normal * (tilt - n * along) for n, tilt in ((x, i), (y, j), (z, k)))
        scale = math.sqrt(x * x + y * y + z * z) * (distance + sigma_distance * far)
        return x / scale, y / scale, z / scale


def add_sigma_vs(frame: FeatureFrame, sigma: float, rng: np.random.Generator) -> FeatureFrame:
    """Add noise to rho [-] and theta [rad] of each line, unreported: the covariances stay as they are.

    Args:
        frame: Result of perception.
        sigma: Standard deviation, the paper's sigma_vs.
        rng: Source of the noise.
    """
    if sigma <= 0.0:
        return frame
    lines = (moved_line(line, *(sigma * rng.standard_normal(2))) for line in frame.lines)
    return dataclasses.replace(frame, lines=tuple(lines))
