"""Wall axes in B, and the turn that levels the vehicle and faces the wall."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ibvs_qp.config import Gains
from ibvs_qp.setpoints.sensed import Body, Touch, Wish, clamp
from ibvs_qp.setpoints.signals import Signals

#: Yaw acceleration asked for at most by a vehicle that has lost a rotor [rad/s^2].
LOST_TURN = 2.0


@dataclass(frozen=True, kw_only=True)
class Wall:
    """Unit vectors in B: normal into the wall, right and down in its plane."""

    normal: ca.SX
    right: ca.SX
    down: ca.SX


def wall_axes(signals: Signals, body: Body, touch: Touch) -> Wall:
    """Right is level and in the wall, down completes it."""
    across = ca.cross(body.down, touch.normal)
    right = signals.output("axis_right", across / ca.fmax(ca.norm_2(across), 1e-6))
    down = signals.output("axis_down", ca.cross(touch.normal, right))
    return Wall(normal=signals.output("normal", touch.normal), right=right, down=down)


def wanted_turn(signals: Signals, gains: Gains, body: Body, touch: Touch, wish: Wish) -> None:
    r"""Angles and wanted accelerations :math:`-K_p \varphi - K_d \dot\varphi` of roll, pitch and yaw [rad/s^2]."""
    roll = ca.atan2(body.down[1], body.down[2])
    pitch = ca.asin(clamp(-body.down[0], -1.0, 1.0))
    yaw = ca.if_else(touch.known, -ca.atan2(touch.normal[1], touch.normal[0]), 0.0)
    level, turn = (gains.attitude_kp, gains.attitude_kd), (gains.yaw_kp, gains.yaw_kd)
    tilt = signals.output("tilt_error", ca.vertcat(roll, pitch) - wish.tilt)
    lost = signals.output("tilted", ca.norm_2(wish.tilt) > 0.0)
    # A tilted vehicle that turns about the vertical has roll and pitch rates without changing either angle.
    p, q, r = ca.vertsplit(body.rate)
    swept = ca.vertcat(p + ca.tan(pitch) * (q * ca.sin(roll) + r * ca.cos(roll)), q * ca.cos(roll) - r * ca.sin(roll))
    rates = signals.output("tilt_rate", ca.if_else(lost, swept, body.rate[:2]))
    wanted = [
        -kp * angle - kd * rate
        for angle, rate, (kp, kd) in zip(
            (tilt[0], tilt[1], yaw), (rates[0], rates[1], body.rate[2]), (level, level, turn), strict=True
        )
    ]
    signals.output("angles", ca.vertcat(roll, pitch, yaw))
    # Tilted for a lost rotor nothing holds yaw: asked for as ever it would cost roll and pitch.
    wanted[2] = ca.if_else(lost, clamp(-gains.yaw_kd * body.rate[2], -LOST_TURN, LOST_TURN), wanted[2])
    signals.output("angular", ca.vertcat(*wanted))
