"""Rendered scenes shared by several test modules."""

from __future__ import annotations

import dataclasses
import math
from importlib import resources

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, align_line, rotation_from_quaternion
from ibvs_qp.vision import Perception, VisionConfig
from sim.sensors.cameras import PlaneCamera
from sim.world.canvas import Canvas
from sim.world.scene import Scene, load_scene

VEHICLE = VehicleParams()
INTERVAL_NS = 33_333_333
TIP = np.array(VEHICLE.tip_position_m)
CAMERA = np.array(VEHICLE.camera_position_m)


def quaternion(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Attitude of z-y-x angles [rad]."""
    cr, sr, cp, sp, cy, sy = (f(0.5 * a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def rotation_vector(before: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Turn from one attitude to the next, in B [rad]."""
    return cv2.Rodrigues(rotation_from_quaternion(before).T @ rotation_from_quaternion(now))[0].ravel()


class World:
    """A scene with a camera that looks from where its tip is said to be."""

    def __init__(self, scene: Scene, seed: int) -> None:
        self.scene, self.canvas = scene, Canvas(scene, seed)
        self.camera = PlaneCamera(scene, VEHICLE, self.canvas, seed)
        self.geometry = self.canvas.geometry
        self.focal = self.camera.intrinsics[0]

    def body_position(self, along: float, up: float, distance: float, attitude: np.ndarray) -> np.ndarray:
        """Where the body is when its tip is at board coordinates and a distance from the board."""
        y, z = self.geometry.point(along, up)
        return np.array([-distance, y, z]) - rotation_from_quaternion(attitude) @ TIP

    def line(
        self, first: tuple[float, float], second: tuple[float, float], position: np.ndarray, attitude: np.ndarray
    ) -> tuple[float, float]:
        """True (rho, theta) of the board line through two (along, up) points."""
        rotation = rotation_from_quaternion(attitude)
        points = []
        for along, up in (first, second):
            y, z = self.geometry.point(along, up)
            x_c, y_c, z_c = R_BODY_CAMERA.T @ (rotation.T @ (np.array([0.0, y, z]) - position) - CAMERA)
            points.append(np.array([x_c / z_c, y_c / z_c, 1.0]))
        a, b, c = np.cross(points[0], points[1])
        length = math.hypot(a, b)
        return -c / length, math.atan2(b, a)

    def plane(self, position: np.ndarray, attitude: np.ndarray) -> tuple[np.ndarray, float]:
        """True outward normal in C and distance of the camera from the board."""
        rotation = rotation_from_quaternion(attitude)
        camera = position + rotation @ CAMERA
        return R_BODY_CAMERA.T @ (rotation.T @ np.array([-1.0, 0.0, 0.0])), -float(camera[0])


def stroke_row(world: World, row: int, start: float, stop: float) -> None:
    """Paint a part of a row."""
    previous = None
    for along in np.linspace(start, stop, max(2, round(abs(stop - start) / 0.005))):
        point = (float(along), world.geometry.row_height(row))
        world.canvas.stroke(previous, point)
        previous = point


def perceive(
    world: World,
    along: np.ndarray,
    up: float | np.ndarray,
    distance: np.ndarray,
    seed: int,
    paint_row: int = 0,
    sway: float = 1.0,
    hints=(),
):
    """Fly along a path with small sway; yields (perceived, position, attitude, true body velocity at mid-interval)."""
    rng = np.random.default_rng(seed)
    perception = Perception(
        VisionConfig(paint_color=world.scene.paint.color, brush_width_m=world.scene.paint.brush_width_m), VEHICLE
    )
    phase = rng.uniform(0.0, 2.0 * math.pi, 3)
    before_attitude = before_position = None
    previous = None
    velocity = None
    for k in range(len(along)):
        angles = sway * np.radians([0.6, 0.6, 1.2]) * np.sin(2.0 * math.pi * 0.4 * k / 30.0 + phase)
        attitude = quaternion(*angles)
        height = float(np.broadcast_to(up, len(along))[k])
        position = world.body_position(float(along[k]), height, float(distance[k]), attitude)
        if paint_row:
            point = (float(along[k]), height)
            world.canvas.stroke(previous, point)
            previous = point
        frame = world.camera.capture(position, attitude, (k + 1) * INTERVAL_NS)
        turn, true_velocity = np.zeros(3), None
        if before_attitude is not None and before_position is not None:
            turn = rotation_vector(before_attitude, attitude)
            middle = rotation_from_quaternion(before_attitude) + rotation_from_quaternion(attitude)
            true_velocity = 0.5 * middle.T @ (position - before_position) / (INTERVAL_NS * 1e-9)
            turn = turn + rng.normal(0.0, 6e-5, 3)
        told = hints(position, attitude) if callable(hints) else hints
        perceived = perception.process(frame, attitude=attitude, rotation=turn, velocity=velocity, hints=told)
        yield perceived, position, attitude, true_velocity
        velocity = perceived.features.velocity
        before_attitude, before_position = attitude, position


def nearest(perceived, truth: tuple[float, float], kind: str):
    """Live line of a kind with the least distance from the truth: (line, offset, angle error), or None."""
    best = None
    for line in perceived.features.lines:
        if line.kind != kind:
            continue
        rho, theta = align_line(line.rho, line.theta, truth[1])
        middle = line.segment.mean(axis=0)
        offset = middle[0] * math.cos(theta) + middle[1] * math.sin(theta) - rho
        offset -= middle[0] * math.cos(truth[1]) + middle[1] * math.sin(truth[1]) - truth[0]
        if best is None or abs(offset) < abs(best[1]):
            best = (line, offset, theta - truth[1])
    return best


class Score:
    """Errors of one line over a flight."""

    def __init__(self, focal: float) -> None:
        self.focal, self.offset, self.angle, self.frames = focal, [], [], 0

    def add(self, perceived, truth: tuple[float, float], kind: str) -> None:
        """Count a frame; a line farther than 4 px is not found."""
        self.frames += 1
        found = nearest(perceived, truth, kind)
        if found is not None and abs(found[1]) * self.focal < 4.0:
            self.offset.append(abs(found[1]) * self.focal)
            self.angle.append(math.degrees(abs(found[2])))

    @property
    def share(self) -> float:
        """Share of frames with the line found."""
        return len(self.offset) / max(self.frames, 1)

    def __str__(self) -> str:
        px, deg = np.percentile(self.offset, [50, 95]), np.percentile(self.angle, [50, 95])
        return f"found {self.share:.3f} offset {px[0]:.3f}/{px[1]:.3f} px angle {deg[0]:.4f}/{deg[1]:.4f} deg"

    def check(self, found: float = 0.99, median: float = 0.05, high: float = 0.3, angle: float = 0.02) -> None:
        """Hold the figures of the issue."""
        assert self.share >= found, str(self)
        assert np.median(self.offset) <= median, str(self)
        assert np.percentile(self.offset, 95) <= high, str(self)
        assert np.median(self.angle) <= angle, str(self)


#: Frames that a new track needs before it may be used.
SETTLE = 4


def scene_of(name: str, **board) -> Scene:
    """A shipped scene, its board changed."""
    with resources.as_file(resources.files("sim.scenes") / f"{name}.toml") as file:
        scene = load_scene(file)
    return dataclasses.replace(scene, board=dataclasses.replace(scene.board, **board)) if board else scene


def edges(world: World) -> dict[str, tuple[tuple[float, float], tuple[float, float]]]:
    """Board edges by name, as pairs of (along, up)."""
    w, h = world.scene.board.width_m, world.scene.board.height_m
    return {"bottom": ((0, 0), (w, 0)), "left": ((0, 0), (0, h)), "right": ((w, 0), (w, h)), "top": ((0, h), (w, h))}


def plane_errors(world: World, perceived, position: np.ndarray, attitude: np.ndarray) -> tuple[float, float]:
    """Distance error [m] and angle of the normal from the truth [deg]."""
    normal, distance = world.plane(position, attitude)
    assert perceived.plane is not None, perceived.refused
    return perceived.plane.distance_m - distance, math.degrees(
        math.acos(min(1.0, float(perceived.plane.normal @ normal)))
    )


class Flight:
    """Errors of a whole rendered flight."""

    def __init__(
        self, world: World, lines: dict[str, tuple[tuple[float, float], tuple[float, float], str]], settle: int = SETTLE
    ) -> None:
        self.world, self.lines, self.settle = world, lines, settle
        self.scores = {name: Score(world.focal) for name in lines}
        self.distance, self.normal, self.velocity, self.normalised = [], [], [], []
        self.frames = self.false = 0

    def run(self, *arguments, **keywords) -> Flight:
        """Fly and score, arguments as of `perceive`."""
        for perceived, position, attitude, velocity in perceive(self.world, *arguments, **keywords):
            self.frames += 1
            distance, normal = plane_errors(self.world, perceived, position, attitude)
            self.distance.append(distance)
            self.normal.append(normal)
            if perceived.features.velocity is not None and velocity is not None:
                error = perceived.features.velocity - velocity
                self.velocity.append(error)
                self.normalised.append(float(error @ np.linalg.solve(perceived.features.velocity_covariance, error)))
            self._count_false(perceived, position, attitude)
            if self.frames > self.settle:
                for name, (first, second, kind) in self.lines.items():
                    self.scores[name].add(perceived, self.world.line(first, second, position, attitude), kind)
        return self

    def _count_false(self, perceived, position: np.ndarray, attitude: np.ndarray) -> None:
        """Live lines that are no edge of board or paint, or one of the wrong kind or surface side."""
        rows = [row_edge(self.world, row, side) for row in (1, 2) for side in (1, -1)]
        true = [board_edge(self.world, name) for name in ("bottom", "left", "right", "top")] + rows
        center = np.array([0.5 * self.world.scene.board.width_m, 0.5 * self.world.scene.board.height_m])
        for line in perceived.features.lines:
            good = False
            for first, second, kind in true:
                if kind != line.kind:
                    continue
                rho, theta = self.world.line(first, second, position, attitude)
                rho, theta = align_line(rho, theta, line.theta)
                across = line.segment @ np.array([math.cos(theta), math.sin(theta)]) - rho
                good |= bool(np.abs(across).max() * self.world.focal < 4.0)
            self.false += not good
            if line.kind == "board":  # the board's middle must lie on the surface side
                y, z = self.world.geometry.point(*center)
                point = rotation_from_quaternion(attitude).T @ (np.array([0.0, y, z]) - position) - CAMERA
                x_c, y_c, z_c = R_BODY_CAMERA.T @ point
                side = x_c / z_c * math.cos(line.theta) + y_c / z_c * math.sin(line.theta) - line.rho
                self.false += side * line.surface_side <= 0.0

    def check(self, normal_deg: float = 0.4, velocity_m_s: float = 0.005, **limits) -> None:
        """Hold the figures; the frame's common mode (1 mm) is not perception's."""
        assert self.false == 0, f"{self.false} live lines that are no edge"
        assert abs(np.mean(self.distance)) <= 0.001
        assert np.std(self.distance) <= 0.0025
        assert np.sqrt(np.mean(np.square(self.normal))) <= normal_deg
        assert len(self.velocity) >= 0.9 * (self.frames - 1)
        assert np.sqrt(np.mean(np.square(self.velocity), axis=0)).max() <= velocity_m_s
        assert np.mean(self.normalised) < 6.0, "covariance claims more than is true (expected 3)"
        for score in self.scores.values():
            score.check(**limits)


def row_edge(world: World, row: int, side: int) -> tuple[tuple[float, float], tuple[float, float], str]:
    """Upper (+1) or lower (-1) edge of a painted row."""
    up = world.geometry.row_height(row) + side * 0.5 * world.scene.paint.brush_width_m
    return (0.0, up), (world.scene.board.width_m, up), "paint"


def board_edge(world: World, name: str) -> tuple[tuple[float, float], tuple[float, float], str]:
    """A board edge as a line to score."""
    return (*edges(world)[name], "board")
