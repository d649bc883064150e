r"""Linear model of the next tenths of a second: vehicle, rotor lag, and the errors in the cost.

In the body's axes of this tick the state is :math:`x = (\delta, \nu, T)`: displacement (translation and rotation) since
this tick, twist, and rotor thrusts. The input u are the thrust commands:

.. math::
    \dot\delta = \nu, \quad m \dot V = B_F T + \theta \times B_F \hat T + h_F, \quad
    J \dot\Omega = B_M T + h_M, \quad \tau \dot T = u - T

with the bias wrench h of the shipped law (gravity, observed external wrench, feed-forward of friction and of the
measured contact moment) and the integrals of the shipped law as disturbances, constant over the horizon: predictions
without offset. Along the wall normal n nothing is predicted: the net force of every command,
:math:`n^T (B_F u + h_F)`, follows the shipped force law in contact and the shipped approach law before. On a wall of
10 kN/m a predicted push rises by 1 N per 0.1 mm, and the felt push lags by its filter: feedback through such a model
made push errors of 1.2 N rms.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ibvs_qp.config.settings import setting, validate
from ibvs_qp.model.feedforward import pivot_stiffness
from ibvs_qp.model.model import Model
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.tasks.line import LineTask, free_directions, line_state
from ibvs_qp.tasks.yaw import LOST_ACCELERATION


@dataclass(frozen=True, kw_only=True)
class MpcSettings:
    """Grid and weights of the predictive law.

    The weights were set by hand on tuning scenes, 20 settings; the cost of thrust changes such that the rms thrust rate
    stays near that of the shipped law. Heavier weights of `normal` make a push beyond reach oscillate.
    """

    step_s: float = setting(
        0.025, "coarse step of the prediction, after one control period", unit="s", low=0.02, high=0.03
    )
    blocks: tuple[int, ...] = (1, 1, 2, 3, 5)  # steps of constant thrust command; the first step is one control period
    line: float = setting(4e4, "line error", low=0.0, high=1e8)
    line_rate: float = setting(650.0, "line error rate", unit="s^2", low=0.0, high=1e8)
    height: float = setting(4.0, "ratio of level lines and vertical motion to the others", low=0.0, high=1e4)
    velocity: float = setting(400.0, "velocity of free directions", unit="s^2/m^2", low=0.0, high=1e8)
    normal: float = setting(0.1, "net force along n against that of the shipped law", unit="1/N^2", low=0.0, high=1e6)
    tilt: float = setting(5e4, "roll and pitch", unit="1/rad^2", low=0.0, high=1e8)
    tilt_rate: float = setting(500.0, "their rates", unit="s^2/rad^2", low=0.0, high=1e8)
    yaw: float = setting(2.5e4, "yaw", unit="1/rad^2", low=0.0, high=1e8)
    yaw_rate: float = setting(500.0, "its rate", unit="s^2/rad^2", low=0.0, high=1e8)
    terminal: float = setting(3.0, "weight of the last step over that of the others", low=1.0, high=1e3)
    thrust_change: float = setting(4.0, "change from one thrust command to the next", unit="1/N^2", low=1e-6, high=1e3)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)

    def steps(self, tick_s: float) -> tuple[float, ...]:
        """Durations of the steps [s]: one control period, then coarse ones."""
        return (tick_s, *[self.step_s] * (sum(self.blocks) - 1))


@dataclass(frozen=True, kw_only=True)
class Error:
    """One error of the cost: row (x, u) + offset + drift t + curve t^2 / 2, with its weight."""

    row: ca.SX
    offset: ca.SX
    weight: ca.SX
    drift: ca.SX | float = 0.0
    curve: ca.SX | float = 0.0


class Prediction:
    """Generator of the linear model, its start, and the errors, as symbols of the step function.

    Args:
        model: Model of the shipped law.
        settings: Weights.
        force: Net force along n of the shipped laws [N], by name of their task row.

    Attributes:
        states: Number of states, 12 + n.
        generator: d/dt (x, u, 1), (states + n + 1, states + n + 1).
        start: x at this tick, (states,).
        errors: Errors of the cost.
    """

    def __init__(self, model: Model, settings: MpcSettings, force: Mapping[str, ca.SX]) -> None:
        self._model, self._settings, self._force = model, settings, force
        self.states = 12 + model.rotors
        self._twist = ca.vertcat(model.body.velocity, model.body.rate)
        self._thrusts = model.signals.next_state("motor_thrust")
        self.start = ca.vertcat(ca.DM.zeros(6), self._twist, self._thrusts)
        self.generator = self._generator()
        self.errors = [*self._line_errors(), *self._free_errors(), *self._normal_errors(), *self._attitude_errors()]

    def _generator(self) -> ca.SX:
        model, n, size = self._model, self._model.rotors, self.states
        vehicle = model.config.vehicle
        inverse_mass = ca.sparsify(np.linalg.inv(vehicle.mass_matrix))
        effectiveness = ca.DM(model.effectiveness)
        lag = vehicle.motor_lag_s
        force = effectiveness[:3, :] @ self._thrusts
        turned = ca.vertcat(-ca.skew(force), ca.DM.zeros(3, 3))
        z = ca.SX.zeros(size + n + 1, size + n + 1)
        z[:6, 6:12] = ca.DM.eye(6)
        z[6:12, 3:6] = inverse_mass @ turned
        z[6:12, 12:size] = inverse_mass @ effectiveness
        z[6:12, -1] = inverse_mass @ model.bias_wrench - self._in_plane_disturbance()
        z[12:size, 12:size] = -ca.DM.eye(n) / lag
        z[12:size, size : size + n] = ca.DM.eye(n) / lag
        return ca.sparsify(z)

    def _in_plane_disturbance(self) -> ca.SX:
        """Acceleration against the travel that the integrals of free velocity have learnt, (6,)."""
        model, free = self._model, free_directions(self._model)
        learnt = [
            model.config.gains.velocity_ki * free[axis] * model.signals.next_state(f"velocity_integral_{axis}")
            for axis in range(2)
        ]
        return ca.vertcat(model.wall.in_body(*learnt), ca.DM.zeros(3))

    def _row(
        self, displacement: ca.SX | None = None, twist: ca.SX | None = None, commands: ca.SX | None = None
    ) -> ca.SX:
        row = ca.SX.zeros(1, self.states + self._model.rotors)
        if displacement is not None:
            row[:6] = displacement
        if twist is not None:
            row[6:12] = twist
        if commands is not None:
            row[self.states :] = commands
        return row

    def _line_errors(self) -> list[Error]:
        model, settings, errors = self._model, self._settings, []
        for line in model.lines:
            task, state = LineTask(line.index), line_state(model, line.index)
            row = ca.jacobian(task.error_row(model) @ model.camera_acceleration, model.acceleration)
            learnt = model.config.gains.line_ki * state.integral
            weight = state.weight * (1.0 + (settings.height - 1.0) * (1.0 - line.vertical))
            now = row @ self._twist  # the measured rate replaces it: the reference moves with the travel
            at = Error(
                row=self._row(displacement=row),
                offset=state.error,
                drift=state.rate - now,
                curve=learnt,
                weight=settings.line * weight,
            )
            moving = Error(
                row=self._row(twist=row), offset=state.rate - now, drift=learnt, weight=settings.line_rate * weight
            )
            errors += [at, moving]
        return errors

    def _free_errors(self) -> list[Error]:
        model, free, level = self._model, free_directions(self._model), 1.0 - self._model.attitude.tilted
        weight = self._settings.velocity * model.body.velocity_known
        axes = (
            (model.wall.right, model.target.velocity_right, weight * free[0] * level),
            (model.wall.down, model.target.velocity_down, weight * free[1] * self._settings.height),
        )
        return [
            Error(row=self._row(twist=ca.horzcat(axis.T, ca.DM.zeros(1, 3))), offset=-target, weight=size)
            for axis, target, size in axes
        ]

    def _normal_errors(self) -> list[Error]:
        """Net force of the commands along n without contact: that of the shipped force and approach laws."""
        model, weight = self._model, self._model.contact_weight
        row = self._row(commands=model.normal.T @ ca.DM(model.effectiveness[:3, :]))
        bias = ca.dot(model.normal, model.bias_wrench[:3])
        shares = {"push": weight, "standoff": (1.0 - weight) * (1.0 - model.attitude.tilted)}
        return [
            Error(row=row, offset=bias - self._force[name], weight=self._settings.normal * share)
            for name, share in shares.items()
        ]

    def _attitude_errors(self) -> list[Error]:
        model, settings, gains = self._model, self._settings, self._model.config.gains
        attitude, rate = model.attitude, model.body.rate
        (soft_pitch, soft_yaw), lines = pivot_stiffness(model.config), model.lines
        pitch = model.pivot_limited(1.0, soft_pitch / gains.attitude_kp, [1.0 - line.vertical for line in lines])
        yaw = model.pivot_limited(1.0, soft_yaw / gains.yaw_kp, [line.vertical for line in lines])
        level = 1.0 - attitude.tilted
        # A vehicle that lost a rotor cannot hold yaw: it brakes as the shipped law does.
        braking = attitude.tilted * clamp(-gains.yaw_kd * rate[2], -LOST_ACCELERATION, LOST_ACCELERATION)
        angles = ca.vertcat(attitude.tilt_error, attitude.yaw)
        drifts = ca.vertcat(attitude.tilt_rate - rate[:2], 0.0)
        weights = (settings.tilt, settings.tilt * pitch**2, settings.yaw * yaw**2 * level)
        rates = (settings.tilt_rate, settings.tilt_rate, settings.yaw_rate)
        errors = []
        for axis in range(3):
            unit = ca.DM.zeros(1, 6)
            unit[3 + axis] = 1.0
            errors.append(
                Error(
                    row=self._row(displacement=ca.SX(unit)),
                    offset=angles[axis],
                    drift=drifts[axis],
                    weight=ca.SX(weights[axis]),
                )
            )
            turning = attitude.tilted * rate[2] if axis == 2 else 0.0
            errors.append(
                Error(
                    row=self._row(twist=ca.SX(unit)),
                    offset=drifts[axis] - turning,
                    drift=-braking if axis == 2 else 0.0,
                    weight=ca.SX(rates[axis]),
                )
            )
        return errors

    @property
    def rows(self) -> ca.SX:
        """Rows of the errors, (errors, states + n)."""
        return ca.sparsify(ca.vertcat(*(error.row for error in self.errors)))

    def values(self) -> list[ca.SX]:
        """Non-zeros of generator and rows; start, offsets (offset, drift, curve) and weights of the errors, dense."""
        offsets = ca.vertcat(*(ca.horzcat(error.offset, error.drift, error.curve) for error in self.errors))
        weights = ca.vertcat(*(error.weight for error in self.errors))
        dense = [ca.vec(ca.densify(value)) for value in (self.start, offsets, weights)]
        return [self.generator.nz[:], self.rows.nz[:], *dense]
