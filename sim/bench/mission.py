"""Pictures of a painting mission along a scripted path: approach, row 1, climb and row 2, with a little sway."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras import PlaneCamera
from sim.world.canvas import Canvas
from sim.world.random_streams import stream
from sim.world.scene import Scene

#: Camera period [ns]; frequency of the sway [Hz] and its amplitudes in roll, pitch and yaw [deg].
PERIOD_NS, _SWAY_HZ, _SWAY_DEG = 33_333_333, 0.4, (0.3, 0.3, 0.6)
#: Start of the approach: tip to board [m].
_START_M = 0.4
#: Error of the integrated gyro between two pictures, per axis [rad].
_GYRO_RAD = 6e-5


@dataclass(frozen=True, kw_only=True)
class Shot:
    """One picture with the motion that the vehicle's sensors measure."""

    frame: RgbdFrame  # colour and depth
    attitude: np.ndarray  # quaternion B in I, (4,)
    rotation: np.ndarray  # rotation of the body since the previous shot, in B [rad], (3,)
    velocity: np.ndarray  # velocity of the body in B [m/s], (3,)


def mission_shots(size: tuple[int, int], count: int, seed: int, vehicle: VehicleParams) -> Iterator[Shot]:
    """Shots at 30 Hz from four parts of a mission, the same number from each.

    Args:
        size: (width, height) of the pictures [px].
        count: Number of shots.
        seed: Of textures, clutter and noise.
        vehicle: Positions of tip and camera.

    Yields:
        Shots; between two parts the brush has painted the stretch between them.
    """
    scene = Scene()
    scene = dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, width=size[0], height=size[1]))
    canvas, rng = Canvas(scene, seed), stream(seed, "bench")
    camera = PlaneCamera(scene, vehicle, canvas, seed)
    phase = rng.uniform(0.0, 2.0 * math.pi, 3)
    before: tuple[np.ndarray, np.ndarray] | None = None
    brush: tuple[float, float] | None = None
    for k, (along, up, distance, painting) in enumerate(_path(scene, canvas, count)):
        angles = np.radians(_SWAY_DEG) * np.sin(2.0 * math.pi * _SWAY_HZ * k * PERIOD_NS * 1e-9 + phase)
        attitude = np.roll(Rotation.from_euler("ZYX", angles[::-1]).as_quat(), 1)
        rotation = rotation_from_quaternion(attitude)
        y, z = canvas.geometry.point(along, up)
        position = np.array([-distance, y, z]) - rotation @ np.array(vehicle.tip_position_m)
        if painting:
            canvas.stroke(brush, (along, up))
        brush = (along, up) if painting else None
        frame = camera.capture(position, attitude, (k + 1) * PERIOD_NS)
        turn, velocity = np.zeros(3), np.zeros(3)
        if before is not None:
            turn = cv2.Rodrigues(before[1].T @ rotation)[0].ravel() + rng.normal(0.0, _GYRO_RAD, 3)
            velocity = rotation.T @ (position - before[0]) / (PERIOD_NS * 1e-9)
        before = position, rotation
        yield Shot(frame=frame, attitude=attitude, rotation=turn, velocity=velocity)


def _path(scene: Scene, canvas: Canvas, count: int) -> Iterator[tuple[float, float, float, bool]]:
    """Tip's board coordinates (along, up), distance to the board [m], and whether the brush paints, per shot."""
    paint, geometry = scene.paint, canvas.geometry
    left, right = geometry.row_ends
    lower, upper = geometry.row_height(1), geometry.row_height(2)
    step = paint.speed_m_s * PERIOD_NS * 1e-9
    each = max(count // 4, 2)
    for k in range(each):
        yield right - 0.1, lower, _START_M * (1.0 - k / each) + 0.1, False
    middle = 0.5 * (left + right)
    _paint(canvas, (right, lower), (middle, lower))
    for k in range(each):
        yield middle - step * k, lower, 0.0, True
    _paint(canvas, (middle - step * each, lower), (left, lower))
    for k in range(each):
        yield left, lower + (upper - lower) * k / each, 0.0, True
    _paint(canvas, (left, upper), (middle, upper))
    for k in range(count - 3 * each):
        yield middle + step * k, upper, 0.0, True


def _paint(canvas: Canvas, start: tuple[float, float], stop: tuple[float, float]) -> None:
    """One straight stroke."""
    canvas.stroke(None, start)
    canvas.stroke(start, stop)
