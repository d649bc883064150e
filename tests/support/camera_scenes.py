"""Camera scenes shared by several test modules."""

from __future__ import annotations

import dataclasses

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from sim.world.board import BoardGeometry
from sim.world.canvas import Canvas
from sim.world.scene import BoardScene, PaintScene, Scene, WallScene

VEHICLE = VehicleParams()
# Black board on a white wall would saturate nothing and leaves the rim the only edge; no clutter.
PLAIN = Scene(
    board=BoardScene(color=(40, 40, 40), clutter=0), wall=WallScene(color=(150, 150, 150)), paint=PaintScene(rows=2)
)
Pose = tuple[np.ndarray, np.ndarray]


def quaternion(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Attitude from z-y-x angles [deg]."""
    half = 0.5 * np.radians([roll, pitch, yaw])
    (cr, cp, cy), (sr, sp, sy) = np.cos(half), np.sin(half)
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def facing(scene: Scene, along: float, up: float, distance: float, *angles: float) -> Pose:
    """Pose whose level tip would face the board point (along, up) at a distance [m]."""
    y, z = BoardGeometry(scene).point(along, up)
    return np.array([-distance - VEHICLE.tip_position_m[0], y, z]), quaternion(*(angles or (0.0, 0.0, 0.0)))


def flat_canvas(scene: Scene) -> Canvas:
    """Canvas without grain: the board's and the wall's plain colours."""
    canvas = Canvas(scene, 0)
    canvas.wall[..., :3] = scene.wall.color
    canvas.flush()[..., :3] = scene.board.color
    return canvas


def sloped(scene: Scene, slope: float) -> Scene:
    return dataclasses.replace(scene, board=dataclasses.replace(scene.board, slope_deg=slope))


def step_positions(profile: np.ndarray, low: float, high: float) -> np.ndarray:
    """Sub-pixel place of one step along every column: where the missing darkness sums up to (px from row 0)."""
    share = (profile - low) / (high - low)
    return share.shape[0] - 0.5 - share.sum(axis=0)
