"""The plant's arithmetic as CasADi functions: readings after a tick, actuator and wind inputs before one.

Each is evaluated on MuJoCo's own arrays in one call.
"""

from __future__ import annotations

import functools
from typing import Any

import casadi as ca

from ibvs_qp.frames import cross, rotate, rotate_back, rotation_rows
from sim.world.crash import FLIP_COSINE, GROUND_CLEARANCE_M

#: Results of `readout` and their sizes; arrays in NED and FRD.
READINGS = {
    "position": 3,  # of the body origin, world [m]
    "velocity": 3,  # of the body origin, world [m/s]
    "quaternion": 4,
    "rate": 3,  # in B [rad/s]
    "rotation": 9,  # B to I, row by row
    "body_velocity": 3,  # in B [m/s]
    "centre_velocity": 3,  # of the true centre of mass, world [m/s]
    "tip": 3,  # world [m]; `Plant` replaces it by its chart, and friction by its parts there
    "felt": 3,  # specific force in B, mean of the tick [m/s^2]
    "ft_wrench": 6,  # vehicle on tool, FRD, at the last physics step [N, N m]
    "push": 1,  # contact force into the wall at the last physics step [N]; of a relief set by `Plant`
    "friction": 3,  # on the tip along the wall, world, at the last physics step [N]
    "depth": 1,  # of the body origin below the ground, < 0 above it [m]
    "sink": 1,  # velocity of the body origin downwards [m/s]
    "upright": 1,  # cosine of the tilt
    "safe": 1,  # 1 where no crash is possible
}
_STARTS = [sum(list(READINGS.values())[:index]) for index in range(len(READINGS) + 1)]
#: Slice of each reading; the first four are the motion, 13 numbers. Behind them all stands the normal contact force at
#: every physics step of the tick [N].
PLACES = {name: slice(*_STARTS[index : index + 2]) for index, name in enumerate(READINGS)}
MOTION = slice(0, PLACES["rate"].stop)
SIZE = _STARTS[-1]
#: Numbers of the contact sensor: found, force (3), normal (3), first tangent (3).
CONTACT_NUMBERS = 10
#: A non-finite or overflowing sum exceeds this [-].
_FINITE = 1e300


def _entries(symbol: ca.SX) -> list[Any]:
    """Entries of a symbol; of any type, so that they go where plain numbers go."""
    return [symbol[index] for index in range(symbol.numel())]


@functools.lru_cache(maxsize=8)
def readout(size: int, accelerometer: int, force: int, torque: int, contact: int, steps: int) -> ca.Function:
    """Function of (qpos, qvel, history, points) yielding `READINGS` and the push at every physics step, in two arrays.

    Args:
        size: Numbers of ``history``, MuJoCo's sensor samples at every physics step.
        accelerometer: Where its samples begin, three numbers each, oldest first; likewise force, torque and contact
            (ten numbers: found, force, normal, tangent).
        force: See there.
        torque: See there.
        contact: See there.
        steps: Physics steps in a tick.

    Points are the true centre of mass (3) and the tip (3) in B [m], how far forward of the origin anything of the
    vehicle but the tool reaches [m], and the way down (x, z) in the world with the depth of the ground [m].
    """
    place, speed = ca.SX.sym("qpos", 7), ca.SX.sym("qvel", 6)
    history, points = ca.SX.sym("history", size), ca.SX.sym("points", 10)

    def sensed(start: int, width: int, step: int) -> list[Any]:
        begin = start + width * (step % steps)
        return _entries(history[begin : begin + width])

    x, y, z, qw, qx, qy, qz = _entries(place)
    vx, vy, vz, wx, wy, wz = _entries(speed)
    position, quaternion = (x, -y, -z), (qw, qx, -qy, -qz)
    velocity, rate = (vx, -vy, -vz), (wx, -wy, -wz)
    rotation = rotation_rows(*quaternion)
    numbers = _entries(points)
    centre, tip, reach = numbers[:3], numbers[3:6], numbers[6]
    down_x, down_z, ground = numbers[7:]

    def downwards(vector: Any) -> Any:
        return down_x * vector[0] + down_z * vector[2]

    swing = rotate(rotation, cross(rate, centre))
    felts = zip(*(sensed(accelerometer, 3, step) for step in range(steps)), strict=True)
    felt = [sum(samples[1:], samples[0]) for samples in felts]
    fraction = 1.0 / steps
    fx, fy, fz, mx, my, mz = (*sensed(force, 3, -1), *sensed(torque, 3, -1))
    touches = [sensed(contact, CONTACT_NUMBERS, step) for step in range(steps)]
    pushes = [ca.if_else(touch[0] > 0.0, touch[1], 0.0) for touch in touches]
    found, _, first, second, *axes = touches[-1]
    (tx, ty, tz), (sx, sy, sz) = axes[3:6], cross(axes[:3], axes[3:6])
    # Minus the force on the board, in FRD: the two signs of y and z cancel.
    along = -first * tx - second * sx, first * ty + second * sy, first * tz + second * sz
    friction = [ca.if_else(found < 1.0, 0.0, value) for value in along]
    total = sum(position[1:], position[0]) + sum(sum(row[1:], row[0]) for row in rotation)
    depth, upright = downwards(position) - ground, downwards([row[2] for row in rotation])
    level = ca.logic_and(upright >= FLIP_COSINE, depth <= -GROUND_CLEARANCE_M)
    safe = ca.logic_and(level, ca.logic_and(position[0] + reach <= 0.0, ca.fabs(total) < _FINITE))
    values = {
        "position": position,
        "velocity": velocity,
        "quaternion": quaternion,
        "rate": rate,
        "rotation": [entry for row in rotation for entry in row],
        "body_velocity": rotate_back(rotation, velocity),
        "centre_velocity": [a + b for a, b in zip(velocity, swing, strict=True)],
        "tip": [a + b for a, b in zip(position, rotate(rotation, tip), strict=True)],
        "felt": (fraction * felt[0], -fraction * felt[1], -fraction * felt[2]),
        "ft_wrench": (fx, -fy, -fz, mx, -my, -mz),
        "push": (pushes[-1],),
        "friction": friction,
        "depth": (depth,),
        "sink": (downwards(velocity),),
        "upright": (upright,),
        "safe": (safe,),
    }
    row = ca.vertcat(*(entry for name in READINGS for entry in values[name]))
    results = [ca.densify(row), ca.densify(ca.vertcat(*pushes))]
    return ca.Function("readout", [place, speed, history, points], results)


@functools.lru_cache(maxsize=8)
def drive(rotors: int) -> ca.Function:
    """MuJoCo's inputs of a tick from the commanded thrusts and the force of the air.

    Function of (commanded, lower, upper, actual thrusts, lags, air, rotation, arm) yielding the limited thrusts [N],
    the time constant of every rotor [s], and force and moment of the air, front-left-up [N, N m]. ``air`` is its force
    at the true centre of mass in the world [N], ``arm`` the way there from the bare vehicle's centre of mass, where
    MuJoCo applies forces, in B [m]. Under a constant command a first-order lag never crosses it, so one choice
    between the lags up and down holds for the tick.
    """
    commanded, lower, upper, actual = (ca.SX.sym(name, rotors) for name in ("commanded", "lower", "upper", "actual"))
    lags, air, rotation, arm = ca.SX.sym("lags", 2), ca.SX.sym("air", 3), ca.SX.sym("rotation", 9), ca.SX.sym("arm", 3)
    command = ca.fmin(ca.fmax(commanded, lower), upper)
    lag = ca.vertcat(*(ca.if_else(command[index] >= actual[index], lags[0], lags[1]) for index in range(rotors)))
    a, b, c, d, e, f, g, h, i = _entries(rotation)
    rows = (a, b, c), (d, e, f), (g, h, i)
    force = tuple(_entries(air))
    mx, my, mz = rotate(rows, cross(_entries(arm), rotate_back(rows, force)))
    fx, fy, fz = force
    applied = ca.vertcat(fx, -fy, -fz, mx, -my, -mz)
    return ca.Function(
        "drive", [commanded, lower, upper, actual, lags, air, rotation, arm], [command, lag, ca.densify(applied)]
    )
