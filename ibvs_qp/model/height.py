"""What the lines and the velocity law together want of the vertical direction: the target of the height row."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.frames import camera_twist_matrix
from ibvs_qp.model.lines import turn_share
from ibvs_qp.model.signals import Signals
from ibvs_qp.tasks.line import symbolic_line_rows

#: Image motion per vertical motion below which a line says nothing about height [1/m].
LEAST_SHARE = 0.1


def height_wish(signals: Signals, config: ControllerConfig) -> ca.SX:
    r"""Acceleration along down [m/s^2] and weight of `HeightTask`, (2,).

    A level line asks for :math:`r^T \dot\nu = \ddot e` with r its row. With roll, pitch, yaw and the sideways motion as
    wanted, what is left of it is a wish for the vertical direction,

    .. math::
        a_{down} = \frac{\ddot e - r_\Omega^T \dot\Omega_{wanted} - (r_V^T d_{right})\, a_{right}}{r_V^T d_{down}},

    so the height row agrees with the line row wherever nothing is limited. Lines and free velocity share by weight.
    In the paper profile the row has no weight: the published law knows no such priority.
    """
    out = signals.outputs
    if config.line_profile == "paper":
        return ca.SX.zeros(2)
    twist = ca.DM(camera_twist_matrix(np.array(config.vehicle.camera_position_m)))
    vertical = signals.input("vertical", config.line_slots)
    turn = turn_share(signals, config) * out["angular"]
    sideways = out["free"][0] * out["velocity_command"][0]
    wish, total = out["free"][1] * out["velocity_command"][1], out["free"][1]
    for slot in range(config.line_slots):
        rho, theta, x, y, wanted, _, weight, _ = ca.vertsplit(out[f"line_{slot}"])
        row_rho, row_theta = symbolic_line_rows(rho, theta, out["plane"])
        row = ((row_rho + (x * ca.sin(theta) - y * ca.cos(theta)) * row_theta) @ twist).T
        down, right = ca.dot(row[:3], out["axis_down"]), ca.dot(row[:3], out["axis_right"])
        tells = ca.fabs(down) > LEAST_SHARE
        share = (1.0 - vertical[slot]) * tells * weight / config.weights.line if config.weights.line else ca.SX(0.0)
        rest = wanted - ca.dot(row[3:], turn) - right * sideways
        wish = wish + share * rest / ca.if_else(tells, down, 1.0)
        total = total + share
    return ca.vertcat(wish / ca.fmax(total, 1e-6), config.weights.height)
