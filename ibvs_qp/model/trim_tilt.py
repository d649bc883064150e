"""Deliberate tilt where a thrust limit would bound the push: a permission of the mission, `limits.trim_deg`."""

from __future__ import annotations

import dataclasses
import math

import casadi as ca

from ibvs_qp.config import ControllerConfig
from ibvs_qp.frames import GRAVITY
from ibvs_qp.model.inputs import Body, Contact, Target
from ibvs_qp.model.reach import REACH_FRACTION, PushPlanes, push_range
from ibvs_qp.symbolic.signals import Signals

#: Price of the tilt over that of a force beyond a plane [N^2/rad^2]: 2 deg cost as much as 0.1 N.
TILT_PRICE = 10.0
#: Time constant of the angles [s]: slower than the level loop, whose poles are at 17 1/s.
TRIM_TIME_S = 0.5
#: Least squared length of a plane's row in the angles, in divisions [N^2/rad^2].
LEAST_ROW = 1e-9


class TrimTilt:
    r"""Least roll and pitch at which the thrust limits allow the push that is asked.

    Tilted by :math:`\theta = (\varphi, \vartheta)` a part of the weight acts along the wall and into it, so the
    planes of the attainable wrench set (`ibvs_qp.model.reach`) move by :math:`C \theta`:

    .. math::
        \min_{\theta, s}\; \tfrac12 P\,\theta^T\theta + \tfrac12 s^T s \quad\text{s.t.}\quad
        l - s \le C\theta + slope\, f_{asked} \le u + s,\; |\theta_i| \le \theta_{max}

    P is `TILT_PRICE`. One sweep of coordinate ascent on the multipliers a tick, from those of the last tick (Hildreth's
    method), solves this program of two variables; the angles follow with `TRIM_TIME_S`. Near level the push itself
    turns with the vehicle by less than 4 % per 2 deg; its direction is that of the tick.

    Attributes:
        angles: Roll and pitch to fly [rad], (2,); zero without permission.
    """

    def __init__(self, signals: Signals, config: ControllerConfig) -> None:
        self._signals, self._config = signals, config
        self._limit = math.radians(config.limits.trim_deg)
        self.angles = signals.state("trim_tilt", 2) if self._limit else ca.SX.zeros(2)

    def update(self, planes: PushPlanes, body: Body, contact: Contact, target: Target) -> None:
        """Set the angles of the next tick, and the output `level_reach` [N].

        Args:
            planes: Planes of the push at the attitude of this tick.
            body: Attitude.
            contact: Without contact the vehicle returns to level.
            target: Push that is asked.
        """
        signals, limit = self._signals, self._limit
        if not limit:
            return
        weight = self._config.vehicle.mass_kg * GRAVITY
        # Without the tilt of this tick, whose noise would be that of the angles.
        gravity = weight * (body.down - ca.DM([0.0, 0.0, 1.0]))
        untilted = planes.normals[:, :3] @ gravity
        level = dataclasses.replace(planes, lower=planes.lower - untilted, upper=planes.upper - untilted)
        signals.output("level_reach", push_range(level)[1])
        pressing = ca.logic_and(contact.touching, target.press)
        push = ca.if_else(pressing, target.push / REACH_FRACTION, 0.0)
        by_angle = weight * ca.horzcat(-planes.normals[:, 1], planes.normals[:, 0])
        rows = ca.vertcat(by_angle, ca.DM.eye(2))
        lower = ca.vertcat(level.lower - planes.slope * push, -limit, -limit)
        upper = ca.vertcat(level.upper - planes.slope * push, limit, limit)
        count = rows.shape[0]
        prices = signals.state("trim_prices", count)
        angles, found = -rows.T @ prices, []
        for row in range(count):
            across, size = rows[row, :], float(ca.sumsqr(rows[row, :]))
            yielding = TILT_PRICE if row < count - 2 else 0.0
            alone = ca.dot(across.T, angles) + size * prices[row]
            price = (alone - ca.fmin(ca.fmax(alone, lower[row]), upper[row])) / max(size + yielding, LEAST_ROW)
            angles = angles - across.T * (price - prices[row])
            found.append(price)
        signals.remember("trim_prices", ca.vertcat(*found))
        wanted = ca.fmin(ca.fmax(angles, -limit), limit)
        part = 1.0 - ca.exp(-body.dt / TRIM_TIME_S)
        signals.output("trim_tilt", signals.remember("trim_tilt", self.angles + part * (wanted - self.angles)))
