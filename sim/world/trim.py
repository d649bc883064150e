"""Pose and thrusts at the start of a flight."""

from __future__ import annotations

import math

import numpy as np

from allocation.effectiveness import control_effectiveness
from allocation.least_squares import allocate_least_squares
from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.world.board import BoardGeometry
from sim.world.random_streams import stream
from sim.world.scene import Scene

#: Half widths of the uniform variation of the start pose by the seed.
START_RIGHT_M, START_DOWN_M, START_DISTANCE_M, START_YAW_DEG = 0.02, 0.03, 0.05, 3.0


def true_limits(scene: Scene, vehicle: VehicleParams) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper thrust limits of the real rotors [N], (n,) each.

    Raises:
        ConfigError: When a list has not one entry per rotor, or a lower limit is not below the upper one.
    """
    truth, count, limits = scene.vehicle, vehicle.geometry.count, []
    for name in ("thrust_min_n", "thrust_max_n"):
        value = getattr(truth, name)
        if isinstance(value, tuple) and len(value) != count:
            raise out_of_range(f"vehicle.{name}", value, "N", f"one number or a list of {count} (one per rotor)")
        limits.append(np.broadcast_to(np.asarray(value, float), (count,)).copy())
    if np.any(limits[0] >= limits[1]):
        raise out_of_range("vehicle.thrust_min_n", truth.thrust_min_n, "N", "must lie below thrust_max_n")
    return limits[0], limits[1]


def hover_thrusts(scene: Scene, vehicle: VehicleParams) -> np.ndarray:
    """Thrusts that come nearest to a level hover of the true vehicle within its true limits [N], (n,)."""
    weight = scene.vehicle.mass_kg * GRAVITY
    hover = np.array([0.0, 0.0, -weight, 0.0, 0.0, 0.0])
    # Rotors carry the weight at the true centre of mass; B counts moments about the assumed one.
    hover[3:] = np.cross(scene.vehicle.com_offset_m, hover[:3])
    return allocate_least_squares(hover, control_effectiveness(vehicle.geometry), *true_limits(scene, vehicle))


def start_pose(scene: Scene, vehicle: VehicleParams, seed: int) -> tuple[np.ndarray, float]:
    """Start position of the body origin, world NED [m] (3,), and yaw [rad]; level, tip facing the wall."""
    distance, right, down, turn = stream(seed, "start").uniform(-1.0, 1.0, 4)
    offset = np.array([-distance * START_DISTANCE_M, right * START_RIGHT_M, down * START_DOWN_M])
    tip = BoardGeometry(scene).start_tip + offset
    yaw = math.radians(scene.start.yaw_deg + turn * START_YAW_DEG)
    x, y, z = vehicle.tip_position_m
    arm = np.array([math.cos(yaw) * x - math.sin(yaw) * y, math.sin(yaw) * x + math.cos(yaw) * y, z])
    return tip - arm, yaw
