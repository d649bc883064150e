"""Geometry of the vehicle for display only: hub, arms, motors, propeller discs, camera, tool and brush, as MJCF.

Sizes follow from the vehicle's parameters where these state them; the others are those of a Tarot T960 with a battery
and a RealSense, and matter to no force.
"""

from __future__ import annotations

import numpy as np

from sim.world.mujoco_frames import FLIP, FLIP_QUATERNION, rotor_quaternion
from sim.world.scene import Scene
from sim.world.true_vehicle import TrueVehicle, turn_quaternion

#: Radius of the hub's plates in distances of a rotor from the centre [-], and half their height [m].
_HUB_SHARE, _HUB_HALF_M = 0.25, 0.02
#: Half sizes of the battery on the hub and of the camera, front-left-up [m].
_BATTERY_M, _CAMERA_M = (0.08, 0.035, 0.025), (0.0125, 0.045, 0.0125)
#: Radius of an arm; radius and half height of a motor, which ends below its propeller [m].
_ARM_RADIUS_M, _MOTOR_M = 0.011, (0.026, 0.02)
#: Half thickness of a propeller disc [m]; radius and half height of the force/torque sensor [m].
_DISC_HALF_M, _SENSOR_M = 0.004, (0.035, 0.012)
#: Length of the brush along the arm, and how far the tip stands out of it [m].
BRUSH_LENGTH_M, _BRUSH_GAP_M = 0.04, 0.002
_BRUSH_COLORS = ((240, 190, 40), (70, 180, 90), (205, 70, 170), (60, 190, 210))
#: Colours (red, green, blue, opacity) 0..1; arms that point forward differ, so that the heading is visible.
_DARK, _GREY, _FRONT, _DISC = "0.13 0.14 0.16 1", "0.38 0.40 0.43 1", "0.85 0.33 0.10 1", "0.35 0.42 0.50 0.32"
_BATTERY, _METAL = "0.20 0.22 0.27 1", "0.66 0.68 0.70 1"


def _numbers(*values: float | np.ndarray | tuple[float, ...]) -> str:
    return " ".join(f"{float(entry):.9g}" for value in values for entry in np.atleast_1d(value))


def _geom(kind: str, size: str, place: str, rgba: str) -> str:
    return f'<geom type="{kind}" size="{size}" {place} rgba="{rgba}" contype="0" conaffinity="0" mass="0"/>'


def _between(kind: str, start: np.ndarray, end: np.ndarray, radius: float, rgba: str) -> str:
    """A capsule or cylinder between two points, front-left-up [m]."""
    return _geom(kind, _numbers(radius), f'fromto="{_numbers(start, end)}"', rgba)


def vehicle_xml(vehicle: TrueVehicle) -> str:
    """Geoms of the vehicle without its tool, in its body frame."""
    geometry, origin = vehicle.geometry, np.zeros(3)
    distance = float(np.median(np.linalg.norm(geometry.positions, axis=1)))
    camera = f'pos="{_numbers(FLIP * vehicle.camera_position_m)}" quat="{_camera_quaternion(vehicle)}"'
    battery = f'pos="{_numbers(0.0, 0.0, _HUB_HALF_M + _BATTERY_M[2])}"'
    sensor = FLIP * vehicle.force_torque_position_m
    parts = [
        _geom("cylinder", _numbers(_HUB_SHARE * distance, _HUB_HALF_M), 'pos="0 0 0"', _DARK),
        _geom("box", _numbers(_BATTERY_M), battery, _BATTERY),
        _geom("box", _numbers(_CAMERA_M), camera, _METAL),
        _between("capsule", origin, sensor, vehicle.arm_radius_m, _DARK),
    ]
    for axis, place in zip(geometry.axes, geometry.positions, strict=True):
        up, turn = FLIP * axis, f'quat="{_numbers(rotor_quaternion(axis))}"'
        motor = FLIP * place - (_MOTOR_M[1] + _DISC_HALF_M) * up
        front = place[0] > 0.5 * distance
        parts += [
            _between("capsule", origin, motor, _ARM_RADIUS_M, _FRONT if front else _GREY),
            _geom("cylinder", _numbers(_MOTOR_M), f'pos="{_numbers(motor)}" {turn}', _DARK),
            _geom(
                "cylinder",
                _numbers(vehicle.propeller_radius_m, _DISC_HALF_M),
                f'pos="{_numbers(FLIP * place)}" {turn}',
                _DISC,
            ),
        ]
    return "\n".join(parts)


def brush_color(scene: Scene) -> tuple[int, int, int]:
    """A brush colour that differs clearly from board, paint and wall."""
    others = np.array([scene.board.color, scene.paint.color, scene.wall.color], float)
    return max(_BRUSH_COLORS, key=lambda color: float(np.linalg.norm(others - color, axis=1).min()))


def tool_xml(vehicle: TrueVehicle, scene: Scene) -> str:
    """Geoms of the tool beyond the force/torque sensor: sensor, arm, and the round brush behind the tip."""
    sensor, tip = FLIP * vehicle.force_torque_position_m, FLIP * vehicle.tip_position_m
    along = (tip - sensor) / max(float(np.linalg.norm(tip - sensor)), 1e-9)
    front, back = (tip - np.array([length, 0.0, 0.0]) for length in (_BRUSH_GAP_M, BRUSH_LENGTH_M))
    half, brush = _SENSOR_M[1] * along, _numbers(np.array(brush_color(scene)) / 255.0, 1.0)
    return "\n".join(
        (
            _between("cylinder", sensor - half, sensor + half, _SENSOR_M[0], _METAL),
            _between("capsule", sensor, back, vehicle.arm_radius_m, _DARK),
            _between("cylinder", back, front, 0.5 * scene.paint.brush_width_m, brush),
        )
    )


def _camera_quaternion(vehicle: TrueVehicle) -> str:
    return _numbers(FLIP_QUATERNION * turn_quaternion(vehicle.camera_turn_deg))
