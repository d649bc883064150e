"""Pose and thrusts at the start of a flight."""

from __future__ import annotations

import math

import numpy as np

from allocation import allocate_least_squares, control_effectiveness
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from ibvs_qp.quaternion import conjugate, multiply
from sim.world.board import BoardGeometry
from sim.world.random_streams import stream
from sim.world.scene import Scene
from sim.world.true_vehicle import TrueVehicle

#: Half widths of the uniform variation of the start pose by the seed.
START_RIGHT_M, START_DOWN_M, START_DISTANCE_M, START_YAW_DEG = 0.02, 0.03, 0.05, 3.0


def hover_thrusts(vehicle: TrueVehicle) -> np.ndarray:
    """Thrusts that come nearest to a level hover of the true vehicle within its true limits [N], (n,)."""
    weight = vehicle.mass_kg * GRAVITY
    hover = np.array([0.0, 0.0, -weight, 0.0, 0.0, 0.0])
    # Rotors carry the weight at the true centre of mass; B counts moments about the assumed one.
    hover[3:] = np.cross(vehicle.com_offset_m, hover[:3])
    return allocate_least_squares(
        hover, control_effectiveness(vehicle.geometry), vehicle.thrust_min, vehicle.thrust_max
    )


def start_pose(scene: Scene, vehicle: VehicleParams, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Start position of the body origin [m] (3,) and quaternion of B in the world (4,); level, tip facing the wall."""
    distance, right, down, turn = stream(seed, "start").uniform(-1.0, 1.0, 4)
    offset = np.array([-distance * START_DISTANCE_M, right * START_RIGHT_M, down * START_DOWN_M])
    return facing(BoardGeometry(scene), vehicle, offset, turn * START_YAW_DEG)


def facing(
    board: BoardGeometry, vehicle: VehicleParams, offset: np.ndarray, turn_deg: float
) -> tuple[np.ndarray, np.ndarray]:
    """Position of the body origin [m] (3,) and quaternion of B in the world (4,) of a level vehicle before the wall.

    Args:
        board: Wall and board with the start of the scene.
        vehicle: Its tip is placed.
        offset: Of the tip from the scene's start, in the chart [m], (3,).
        turn_deg: Yaw from that of the scene's start [deg].
    """
    yaw = math.radians(board.scene.start.yaw_deg + turn_deg) + board.bearing(board.start_tip)
    x, y, z = vehicle.tip_position_m
    arm = board.from_ned @ (math.cos(yaw) * x - math.sin(yaw) * y, math.sin(yaw) * x + math.cos(yaw) * y, z)
    level = math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)
    tip = board.surface.points(board.start_tip + offset)
    return tip - arm, np.array(multiply(conjugate(board.attitude.tolist()), level))
