"""Pictures with single errors of a real camera, shared by several test modules."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from camera_scenes import PLAIN, VEHICLE, Pose, facing, flat_canvas

from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras import PlaneCamera
from sim.world.errors import CameraErrors, DepthErrors, GyroErrors, WorldErrors
from sim.world.scene import Scene

#: Board's left edge in the left part of the picture.
AT_LEFT: Pose = facing(PLAIN, 0.13, 0.25, 0.05)
#: Grey levels of board and wall in `PLAIN`.
BOARD, WALL = 40.0, 150.0


def with_errors(scene: Scene = PLAIN, vibration_rad_s: float = 0.0, **sections: dict[str, Any]) -> Scene:
    """A scene with errors of ``camera`` and ``depth``."""
    errors = WorldErrors(
        camera=CameraErrors(**sections.get("camera", {})),
        depth=DepthErrors(**sections.get("depth", {})),
        gyro=GyroErrors(vibration_rad_s=vibration_rad_s),
    )
    return dataclasses.replace(scene, errors=errors)


def camera_of(scene: Scene, seed: int = 0, noise: bool = False) -> PlaneCamera:
    return PlaneCamera(scene, VEHICLE, flat_canvas(scene), seed, noise=noise)


def taken(scene: Scene, pose: Pose = AT_LEFT, twist: tuple[float, ...] = (0.0,) * 6) -> RgbdFrame:
    """The first picture of a camera without noise; twist: velocity [m/s] and angular velocity [rad/s] in B."""
    return camera_of(scene).capture(*pose, 0, np.array(twist))


def left_edge(frame: RgbdFrame, rows: np.ndarray) -> np.ndarray:
    """Sub-pixel column of the board's left edge in the given rows [px], between wall on the left and board."""
    crop = frame.rgb[rows, :250, 0].astype(float)
    return (crop - BOARD).sum(axis=1) / (WALL - BOARD) - 0.5


def edge_spread(frame: RgbdFrame, row: int) -> tuple[float, float]:
    """Mean column and standard deviation of the left edge's blur in a row [px]."""
    darkening = -np.diff(frame.rgb[row, :250, 0].astype(float)) / (WALL - BOARD)
    columns = np.arange(len(darkening)) + 0.5
    mean = float((columns * darkening).sum() / darkening.sum())
    return mean, float(np.sqrt(max(0.0, ((columns - mean) ** 2 * darkening).sum() / darkening.sum())))
