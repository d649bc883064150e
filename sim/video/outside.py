"""The flight from outside: the vehicle at the wall, as a camera beside it sees it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import mujoco
import numpy as np

from ibvs_qp.config.files import parse_toml
from ibvs_qp.config.settings import from_dict
from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.pilot import PilotConfig
from sim.flight.surroundings import PAINTING_FORCE
from sim.flight.trace import Trace
from sim.video.rasterizer import (
    OVERSAMPLING,
    OutsideCamera,
    Rasterizer,
    Triangles,
    cast,
    darken,
    geom_triangles,
    light_on,
    shadow,
)
from sim.world.board import BoardGeometry
from sim.world.canvas import TEXTURE_PAD_PX, Canvas
from sim.world.mjcf import build_model
from sim.world.mujoco_frames import FLIP
from sim.world.true_vehicle import TrueVehicle, true_vehicle

#: Colour of the floor, red, green, blue 0..1.
_FLOOR = (0.56, 0.55, 0.53)
_OUTWARD, _UPWARD = np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
#: Pixels around fresh paint that its filtering reaches [px].
_RIM_PX = 3


class Backdrop:
    """Wall, floor and board under one camera; nothing of the vehicle is ever behind them.

    Args:
        canvas: The board's picture; strokes on it appear at the next `refresh`.
        rasterizer: For its camera.

    Attributes:
        colour: The picture at the rasterizer's size, red, green, blue 0..1, float32.
        on_board: Fraction of every pixel of the finished picture that shows the board, float32.
    """

    def __init__(self, canvas: Canvas, rasterizer: Rasterizer) -> None:
        self._canvas = canvas
        board, gap, pad = canvas.scene.board, canvas.scene.board.gap_m, TEXTURE_PAD_PX
        height, width = rasterizer.depth.shape
        left, top = canvas.wall_origin
        right, bottom = canvas.wall_origin + np.array(canvas.wall.shape[1::-1]) / canvas.wall_pixels_per_m
        rims = np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
        to_picture = _homography(rasterizer, canvas.wall, 0, rims, gap)
        # beyond the wall's picture its mirror image goes on
        wall = cv2.warpPerspective(canvas.wall, to_picture, (width, height), borderMode=cv2.BORDER_REFLECT)
        self._light = np.float32(light_on(_OUTWARD[None])[0] / 255.0)
        self.colour = wall[..., :3] * self._light
        self.colour[_shows_floor(rasterizer, gap)] = np.array(_FLOOR, np.float32) * light_on(_UPWARD[None])
        rims = canvas.geometry.point(np.array([0, 1, 1, 0]) * board.width_m, np.array([1, 1, 0, 0]) * board.height_m)
        outline = FLIP * np.column_stack((np.zeros(4), rims))
        darken(self.colour, shadow(rasterizer, [cast(outline, gap)], [1.0]))
        self._to_picture = _homography(rasterizer, canvas.texture, pad, rims, 0.0)
        self._inside = np.zeros(canvas.texture.shape[:2], np.float32)
        self._inside[pad:-pad, pad:-pad] = 1.0
        canvas.flush()
        self._lay_board(0, height, 0, width)
        share = cv2.warpPerspective(self._inside, self._to_picture, (width, height))
        self.on_board = cv2.resize(share, rasterizer.camera.size, interpolation=cv2.INTER_AREA)

    def refresh(self) -> None:
        """Bring `colour` up to date with the canvas."""
        if (box := self._canvas.refresh()) is None:
            return
        r0, r1, c0, c1 = box
        rims = np.array([[(c0, r0), (c1, r0), (c1, r1), (c0, r1)]], np.float32)
        seen = cv2.perspectiveTransform(rims, self._to_picture)[0]
        (left, top), (right, bottom) = np.floor(seen.min(axis=0)) - _RIM_PX, np.ceil(seen.max(axis=0)) + _RIM_PX
        height, width = self.colour.shape[:2]
        self._lay_board(max(int(top), 0), min(int(bottom), height), max(int(left), 0), min(int(right), width))

    def _lay_board(self, r0: int, r1: int, c0: int, c1: int) -> None:
        """Draw the board's texture into a box of the picture."""
        if r0 >= r1 or c0 >= c1:
            return
        into, size = np.array([(1, 0, -c0), (0, 1, -r0), (0, 0, 1.0)]) @ self._to_picture, (c1 - c0, r1 - r0)
        share = cv2.warpPerspective(self._inside, into, size)[..., None]
        drawn = cv2.warpPerspective(self._canvas.texture, into, size, borderMode=cv2.BORDER_REPLICATE)[..., :3]
        part = self.colour[r0:r1, c0:c1]
        part += share * (drawn * self._light - part)


def _homography(
    rasterizer: Rasterizer, texture: np.ndarray, pad: int, corners: np.ndarray, depth_m: float
) -> np.ndarray:
    """Map from the pixels of a picture to the rasterizer's; corners from the upper left, world NED (y, z) [m]."""
    height, width = texture.shape[:2]
    low, right, bottom = pad - 0.5, width - pad - 0.5, height - pad - 0.5  # borders of pixels, not centres
    source = np.array([(low, low), (right, low), (right, bottom), (low, bottom)], np.float32)
    world = FLIP * np.column_stack((np.full(4, depth_m), corners))
    target = OVERSAMPLING * rasterizer.camera.project(world) - 0.5
    return cv2.getPerspectiveTransform(source, target.astype(np.float32))


def _shows_floor(rasterizer: Rasterizer, wall_m: float) -> np.ndarray:
    """Whether the ray of a pixel meets the floor before the wall, (height, width) bool."""
    camera, (height, width) = rasterizer.camera, rasterizer.depth.shape
    focal = OVERSAMPLING * camera.focal_px
    across = (np.arange(width) + 0.5 - 0.5 * width) / focal
    upward = (0.5 * height - np.arange(height) - 0.5) / focal
    right, up, backward = camera.axes
    ahead, rising = (across * right[axis] + upward[:, None] * up[axis] - backward[axis] for axis in (0, 2))
    with np.errstate(divide="ignore"):
        met = camera.eye[0] - camera.eye[2] / rising * ahead
    return (rising < 0.0) & (met < wall_m)


# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false


#: Resolution of the board's picture [px/m], and distance between its strokes [m]: finer than a pixel of the video.
_BOARD_PX_M, _STROKE_M = 500.0, 0.002
#: Places along the way that must be in the picture [-].
_PLACES = 40
#: Opacity below which a geom is drawn through: a disc that stands for a turning propeller.
_SOLID = 0.99


@dataclass(frozen=True)
class VehicleShape:
    """Surfaces of the vehicle in MuJoCo's body frame (front-left-up, origin at the assumed centre of mass)."""

    solid: Triangles
    discs: Triangles  # translucent surfaces
    opacity: float  # of the discs 0..1
    points: np.ndarray  # corners of all parts, discs first [m], (V, 3)
    starts: np.ndarray  # first corner of every part, (P,)
    opacities: list[float]  # of every part, P

    @classmethod
    def of(cls, trace: Trace, vehicle: TrueVehicle) -> VehicleShape:
        """Surfaces of the geoms that MuJoCo's own window shows."""
        model, ids = build_model(trace.scene, vehicle)
        data = mujoco.MjData(model)
        data.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
        mujoco.mj_kinematics(model, data)
        geoms = np.flatnonzero(model.geom_bodyid >= ids.vehicle)
        shows = model.geom_rgba[geoms, 3]
        solid, discs = (
            [each for geom in kind if (each := geom_triangles(model, data, geom)) is not None]
            for kind in (geoms[shows > _SOLID], geoms[shows <= _SOLID])
        )
        opacity, parts = float(shows.min()), [*discs, *solid]
        return cls(
            solid=Triangles.joined(solid),
            discs=Triangles.joined(discs),
            opacity=opacity,
            points=np.concatenate([part.points for part in parts]),
            starts=np.cumsum([0, *(len(part.points) for part in parts[:-1])]),
            opacities=[opacity] * len(discs) + [1.0] * len(solid),
        )


class OutsideView:
    """Pictures of one flight from outside, in the order of its ticks.

    Args:
        trace: The flight.
        camera: The camera; `scene_points` of several flights give one that shows them all.
    """

    def __init__(self, trace: Trace, camera: OutsideCamera) -> None:
        self._trace = trace
        self._shape = VehicleShape.of(trace, flown_vehicle(trace))
        self._canvas = Canvas(trace.scene, trace.seed, _BOARD_PX_M)
        self._geometry = BoardGeometry(trace.scene)
        self._rasterizer = Rasterizer(camera)
        self._backdrop = Backdrop(self._canvas, self._rasterizer)
        self._painted_to = 0
        self._brush: tuple[float, float] | None = None

    def draw(self, tick: int) -> np.ndarray:
        """Picture at a tick, not before that of the last call: uint8 RGB (height, width, 3)."""
        self._paint(tick)
        self._backdrop.refresh()
        drawer, shape, pose = self._rasterizer, self._shape, vehicle_pose(self._trace, tick)
        drawer.clear(self._backdrop.colour)
        points = shape.points @ pose[:3, :3].T + pose[:3, 3]
        dark = []
        for depth_m in (0.0, self._trace.scene.board.gap_m):
            parts = np.split(cast(points, depth_m), shape.starts[1:])
            dark.append(shadow(drawer, parts, shape.opacities))
        darken(drawer.colour, dark[1] + self._backdrop.on_board * (dark[0] - dark[1]))
        drawer.draw(shape.solid, pose)
        below = drawer.colour.copy()
        drawer.draw(shape.discs, pose)
        drawer.colour = cv2.addWeighted(drawer.colour, shape.opacity, below, 1.0 - shape.opacity, 0.0)
        return drawer.finished()

    def background(self) -> np.ndarray:
        """The picture of the last call without the vehicle and its shadow, uint8 RGB (height, width, 3)."""
        self._rasterizer.clear(self._backdrop.colour)
        return self._rasterizer.finished()

    def _paint(self, tick: int) -> None:
        """Repeat the strokes of the flight up to a tick."""
        trace = self._trace
        for now in range(self._painted_to, tick + 1):
            if trace.push_true[now] <= PAINTING_FORCE:
                self._brush = None
                continue
            point = self._geometry.spot(*trace.tip[now, 1:].tolist())
            if self._brush is None or np.hypot(point[0] - self._brush[0], point[1] - self._brush[1]) > _STROKE_M:
                self._canvas.stroke(self._brush, point)
                self._brush = point
        self._painted_to = tick + 1


def flown_vehicle(trace: Trace) -> TrueVehicle:
    """The vehicle that flew: that of the preset, with the errors of scene and seed."""
    config = from_dict(PilotConfig, parse_toml(trace.preset, "preset"))
    return true_vehicle(trace.scene, config.controller.vehicle, trace.seed)


def vehicle_pose(trace: Trace, tick: int) -> np.ndarray:
    """Homogeneous transform of MuJoCo's body frame into its world at a tick, (4, 4)."""
    rotation = rotation_from_quaternion(trace.attitude[tick])
    pose = np.eye(4)
    pose[:3, :3] = FLIP[:, None] * rotation * FLIP
    pose[:3, 3] = FLIP * trace.position[tick]
    return pose


def scene_points(trace: Trace) -> np.ndarray:
    """Points that a picture of the flight must show: board, and rotors along the way, MuJoCo's world [m], (N, 3)."""
    vehicle, board = flown_vehicle(trace), trace.scene.board
    corners = BoardGeometry(trace.scene).point(
        np.array([0, 1, 1, 0]) * board.width_m, np.array([0, 0, 1, 1]) * board.height_m
    )
    points = [FLIP * np.column_stack((np.zeros(4), corners))]
    rotors = FLIP * vehicle.geometry.positions
    rotors = rotors * (1.0 + vehicle.propeller_radius_m / np.linalg.norm(rotors, axis=1, keepdims=True))
    for tick in np.linspace(0, len(trace.t) - 1, _PLACES).astype(int):
        pose = vehicle_pose(trace, tick)
        points.append(rotors @ pose[:3, :3].T + pose[:3, 3])
    return np.concatenate(points)
