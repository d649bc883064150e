"""Deliberate tilt where a thrust limit would bound the push: a permission of the mission, `limits.trim_deg`."""

from __future__ import annotations

import dataclasses
import math

import casadi as ca

from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.inputs import Body, Contact
from ibvs_qp.frames import GRAVITY
from ibvs_qp.model.inputs import Target
from ibvs_qp.model.reach import PushPlanes, push_range
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.symbolic.signals import Signals

#: Price of the tilt over that of a force beyond a plane [N^2/rad^2]: 2 deg cost as much as 0.1 N.
TILT_PRICE = 10.0
#: Fraction of the reach that the push may use before the vehicle tilts [-]: rotors whose thrusts differ by some
#: percent from the model's and a level loop at work keep off their limits. At 0.97, which a level push may use, slides
#: of 10 N at friction 0.8 in the datasheet world had a rotor at its limit for half of the time, and 0.7 N of push error
#: instead of 0.3 N.
TRIM_FRACTION = 0.85
#: Time constant of the angles [s]: slower than the level loop, whose slow pole is at 7 1/s.
TRIM_TIME_S = 0.5


class TrimTilt:
    r"""Least roll and pitch at which the thrust limits allow the commanded push.

    In level axes the rotors must make the force :math:`F = f d - m g e_z` and the moment :math:`f p \times d` of the
    push f along :math:`d = n + \mu t`. In a body tilted by :math:`\theta = (\varphi, \vartheta)` they change by
    :math:`F \times \theta` and :math:`f p \times (d \times \theta)`, so the planes :math:`(y_F, y_M)` of the attainable
    wrench set (`ibvs_qp.model.reach`) change by :math:`C \theta`:

    .. math::
        \min_{\theta, s}\; \tfrac12 P\,\theta^T\theta + \tfrac12 s^T s \quad\text{s.t.}\quad
        l - s \le slope\, f_{asked} + C\theta \le u + s,\; |\theta_i| \le \theta_{max}

    P is `TILT_PRICE`. One sweep of coordinate ascent on the multipliers a tick, from those of the last tick (Hildreth's
    method), solves this program of two variables; the angles follow with `TRIM_TIME_S`.

    Attributes:
        angles: Commanded roll and pitch of this tick [rad], (2,); zero without permission.
    """

    def __init__(self, signals: Signals, config: ControllerConfig) -> None:
        self._signals, self._config = signals, config
        self._limit = math.radians(config.limits.trim_deg)
        self.angles = signals.state("trim_tilt", 2) if self._limit else ca.SX.zeros(2)

    def update(self, planes: PushPlanes, body: Body, contact: Contact, target: Target) -> None:
        """Set the angles of the next tick, output `trim_tilt` [rad], and the output `level_reach` [N].

        Args:
            planes: Planes of the push at the attitude of this tick.
            body: Attitude.
            contact: Off the wall the vehicle returns to level.
            target: Commanded push. While it commands a tilt itself, because of a limited rotor, the trim is zero.
        """
        signals, limit, vehicle = self._signals, self._limit, self._config.vehicle
        if not limit:
            return
        weight, tip = vehicle.mass_kg * GRAVITY, ca.DM(vehicle.tip_position_m)
        force_normals, moment_normals = planes.normals[:, :3], planes.normals[:, 3:]
        direction = _in_level_axes(planes.direction, body.down)
        untilted = weight * (force_normals @ (body.down - ca.DM([0.0, 0.0, 1.0])))
        level = dataclasses.replace(
            planes,
            direction=direction,
            slope=force_normals @ direction + moment_normals @ ca.cross(tip, direction),
            lower=planes.lower - untilted,
            upper=planes.upper - untilted,
        )
        signals.output("level_reach", push_range(level)[1])
        other = ca.norm_2(ca.vertcat(target.roll, target.pitch, target.trim_roll, target.trim_pitch)) > 0.0
        pressing = ca.logic_and(ca.logic_and(contact.touching, target.press), ca.logic_not(other))
        push = target.push / TRIM_FRACTION
        force, columns = push * direction - ca.vertcat(0.0, 0.0, weight), []
        for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
            turned = ca.cross(tip, ca.cross(push * direction, ca.DM(axis)))
            columns.append(force_normals @ ca.cross(force, ca.DM(axis)) + moment_normals @ turned)
        rows = ca.vertcat(ca.horzcat(*columns), ca.DM.eye(2))
        lower = ca.vertcat(level.lower - level.slope * push, -limit, -limit)
        upper = ca.vertcat(level.upper - level.slope * push, limit, limit)
        goal = self._sweep(rows, lower, upper, pressing)
        part = 1.0 - ca.exp(-body.dt / TRIM_TIME_S)
        signals.output("trim_tilt", signals.remember("trim_tilt", self.angles + part * (goal - self.angles)))

    def _sweep(self, rows: ca.SX, lower: ca.SX, upper: ca.SX, pressing: ca.SX) -> ca.SX:
        """Angles after one sweep over the multipliers of all rows [rad], (2,); 0, as those, while not pressing.

        The bounds of the angles come last, and without slack: they hold exactly.
        """
        count, signals = rows.shape[0], self._signals
        prices = signals.state("trim_prices", count)
        angles, found = -rows.T @ prices, []
        for row in range(count):
            across = rows[row, :]
            size, yielding = ca.sumsqr(across), TILT_PRICE if row < count - 2 else 0.0
            alone = ca.dot(across.T, angles) + size * prices[row]
            price = (alone - clamp(alone, lower[row], upper[row])) / (size + yielding)
            angles = angles - across.T * (price - prices[row])
            found.append(price)
        signals.remember("trim_prices", ca.if_else(pressing, ca.vertcat(*found), 0.0))
        return ca.if_else(pressing, angles, 0.0)


def _in_level_axes(vector: ca.SX, down: ca.SX) -> ca.SX:
    """A vector in B in the axes that roll and pitch have turned away from, (3,); ``down`` is unit gravity in B."""
    x, y, z = ca.vertsplit(vector)
    across = ca.sqrt(down[1] ** 2 + down[2] ** 2)
    (sine_roll, cosine_roll), (sine, cosine) = (down[1] / across, down[2] / across), (-down[0], across)
    right, below = cosine_roll * y - sine_roll * z, sine_roll * y + cosine_roll * z
    return ca.vertcat(cosine * x + sine * below, right, cosine * below - sine * x)
