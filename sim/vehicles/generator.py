"""Vehicles drawn at random: rotors, mass, tilt, arm, force sensor and camera; one seed is one vehicle."""

from __future__ import annotations

import math

import numpy as np

from allocation import Rotor, RotorGeometry
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.world.random_streams import stream

#: Numbers of rotors.
ROTORS = (6, 7, 8)
#: Ranges: all-up mass [kg], tilt [deg], radius of the circle at 6 kg [m], which grows with the cube root of the mass.
_MASS_KG, _TILT_DEG, _CIRCLE_M = (2.0, 12.0), (15.0, 40.0), (0.42, 0.52)
#: Propeller radius as a fraction of the largest one without overlap, thrust in all over weight, idle over full thrust
#: [-].
_FILL, _THRUST_RATIO, _IDLE = (0.70, 0.92), (2.2, 4.5), (0.015, 0.035)
#: Moment per thrust over propeller radius [-]; motors' lag, rising and falling [s].
_TORQUE, _LAG_UP_S, _LAG_DOWN_S = (0.08, 0.13), (0.03, 0.07), (0.045, 0.10)
#: Tip ahead of the foremost propeller, and its height [m].
_AHEAD_M, _TIP_DOWN_M = (0.08, 0.30), (-0.08, 0.08)
#: Camera: distance to the wall in contact, beside and below or above the arm [m], turn about its axis and aside [deg].
_WALL_M, _BESIDE_M, _BELOW_M, _ASKEW_DEG = (0.35, 0.75), (-0.06, 0.06), (0.06, 0.14), (-4.0, 4.0)
#: Row of the tip in the picture, from its upper border as a fraction of the height [-], and vertical field of view
#: [deg].
_TIP_ROW, _FIELD_DEG = (0.15, 0.55), (42.0, 70.0)
#: Picture sizes [px].
_SIZES = ((640, 480), (424, 240), (848, 480))
#: Turns of the force sensor about the push axis [deg].
_SENSOR_TURNS_DEG = (0.0, 90.0, -90.0, 180.0, 30.0)
_TARGET_KG, _TOOL_SHARE = 6.0, (0.03, 0.08)


def random_vehicle(seed: int) -> VehicleParams:
    """Draw a vehicle that someone might build; nothing makes sure that it can paint.

    The arm runs between two rotors. The camera is anywhere below or above it, turned so that the tip has a place in the
    upper half of the picture.

    Args:
        seed: Number of the vehicle.
    """
    rng = stream(seed, "vehicle")
    count, mass = int(rng.choice(ROTORS)), float(rng.uniform(*_MASS_KG))
    tilt, circle = float(rng.uniform(*_TILT_DEG)), float(rng.uniform(*_CIRCLE_M)) * (mass / _TARGET_KG) ** (1.0 / 3.0)
    radius = float(rng.uniform(*_FILL)) * circle * math.sin(math.pi / count)
    azimuths = [360.0 * (index + 0.5) / count for index in range(count)]
    rotors = tuple(
        Rotor(name=f"rotor_{index}", azimuth_deg=azimuth - 360.0 * (azimuth > 180.0), spin=1 if index % 2 else -1)
        for index, azimuth in enumerate(azimuths)
    )
    geometry = RotorGeometry(
        rotors=rotors,
        circle_radius_m=circle,
        tilt_deg=tilt,
        torque_ratio_m=float(rng.uniform(*_TORQUE)) * radius,
    )
    full = float(rng.uniform(*_THRUST_RATIO)) * mass * GRAVITY / (count * math.cos(math.radians(tilt)))
    # Half of the mass in the middle, half at the rotors: 0.5 m R^2 / 2 about x and y, 0.5 m R^2 about z.
    inertia = 0.25 * mass * circle**2 * rng.uniform(0.5, 0.9, 3) * (1.0, 1.2, 1.8)
    inertia[2] = min(inertia[2], 0.98 * (inertia[0] + inertia[1]))
    front = float((geometry.positions[:, 0] + radius).max())
    tip = np.array((front + rng.uniform(*_AHEAD_M), 0.0, rng.uniform(*_TIP_DOWN_M)))
    sensor = np.array((rng.uniform(0.3, 0.5) * tip[0], 0.0, tip[2]))
    size = _SIZES[int(rng.integers(len(_SIZES)))]
    camera, turn, focal = _camera(rng, tip, size)
    return VehicleParams(
        geometry=geometry,
        mass_kg=mass,
        inertia_kg_m2=_vector(inertia),
        thrust_min_n=float(rng.uniform(*_IDLE)) * full,
        thrust_max_n=full,
        motor_lag_up_s=float(rng.uniform(*_LAG_UP_S)),
        motor_lag_down_s=float(rng.uniform(*_LAG_DOWN_S)),
        propeller_radius_m=radius,
        linear_drag_n_s_m=0.9 * (circle / 0.48) ** 2,
        tip_position_m=_vector(tip),
        force_torque_position_m=_vector(sensor),
        force_torque_turn_deg=(float(rng.choice(_SENSOR_TURNS_DEG)), 0.0, 0.0),
        tool_mass_kg=float(rng.uniform(*_TOOL_SHARE)) * mass,
        tool_position_m=_vector(0.4 * sensor + 0.6 * tip),
        camera_position_m=_vector(camera),
        camera_turn_deg=_vector(turn),
        camera_size_px=size,
        camera_intrinsics_px=(focal, focal, 0.5 * (size[0] - 1), 0.5 * (size[1] - 1)),
    )


def _camera(rng: np.random.Generator, tip: np.ndarray, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, float]:
    """Place [m], turn [deg] and focal length [px] of a camera that has the tip in its picture."""
    depth, side = rng.uniform(*_WALL_M), 1.0 if rng.random() < 0.75 else -1.0
    place = np.array((tip[0] - depth, rng.uniform(*_BESIDE_M), tip[2] + side * rng.uniform(*_BELOW_M)))
    focal = 0.5 * size[1] / math.tan(0.5 * math.radians(rng.uniform(*_FIELD_DEG)))
    in_picture = math.atan((rng.uniform(*_TIP_ROW) - 0.5) * size[1] / focal)  # below the optical axis
    up = math.atan2(place[2] - tip[2], depth) + in_picture  # of the optical axis: FRD turns nose up about +y
    roll, yaw = rng.uniform(*_ASKEW_DEG, 2)
    return place, np.array((roll, math.degrees(up), yaw)), focal


def _vector(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 6) for value in values)
    return x, y, z
