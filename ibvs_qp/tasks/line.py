"""Image-based visual servoing of a line, at the point where the tip meets the wall."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ibvs_qp.model.inputs import LEAST_GAIN, LINE_OUTPUTS, Line
from ibvs_qp.model.interaction_matrix import endpoint_line_row, symbolic_line_rows
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.tasks.task import Task

#: Errors enter the law up to this size [normalised]: a far line is approached at a constant pace.
ERROR_BOUND = 0.10
#: Bound of the integral of a line error, as the image acceleration that it commands [1/s^2].
INTEGRAL_BOUND = 0.6
#: Filter of the differentiated error while no velocity is known [s].
RATE_FILTER = 0.08
#: Least time step of that difference [s].
LEAST_STEP = 1e-4


@dataclass(frozen=True, kw_only=True)
class LineState:
    r"""Errors and rates of one line; interaction matrix rows in C.

    Attributes:
        row_rho, row_theta: Rows of the interaction matrix, (1, 6).
        error: :math:`\rho - (x_t\cos\theta + y_t\sin\theta)` minus its reference, bounded; rate: its rate [1/s].
        integral: Of the error [s].
        rho_error: rho minus its reference, bounded (paper); rho_rate: its rate [1/s].
        analytic_row: Row of the analytic law on the body's acceleration, (1, 6); analytic_command: image acceleration
            for it [1/s^2].
        angle_error: theta minus its reference [rad]; angle_rate: its rate [rad/s]; angle_command: [rad/s^2].
        image_rate: Rate of rho in the picture, without that of its reference [1/s].
        weight: Of the rows, 0 to 1: presence, confidence and variance of the line.
    """

    row_rho: ca.SX
    row_theta: ca.SX
    error: ca.SX
    rate: ca.SX
    integral: ca.SX
    rho_error: ca.SX
    rho_rate: ca.SX
    analytic_row: ca.SX
    analytic_command: ca.SX
    angle_error: ca.SX
    angle_rate: ca.SX
    angle_command: ca.SX
    image_rate: ca.SX
    weight: ca.SX


class LineTask(Task):
    r"""One line of the picture converges to its reference, about the tip's wall point.

    .. math:: L S \dot\nu = -(K_p e + K_d (\dot e + T L S \dot\nu_{now}) + K_i \textstyle\int e), \qquad
              e = \rho - (x_t\cos\theta + y_t\sin\theta) - (\rho_{ref} - x_0 \cos\theta_{ref} - y_0 \sin\theta_{ref})

    with the row :math:`L = L_\rho + (x_t \sin\theta - y_t \cos\theta) L_\theta` and (x_t, y_t) the image of the point
    where the tip meets the wall, (x_0, y_0) that of a level vehicle square to it: endpoint closed loop. T is the lead
    against the motors' lag; `Model.filtered` follows. The angle row has no integral and yields to level flight.
    """

    weight_settings = ("weights.line", "weights.line_angle")

    def __init__(self, index: int) -> None:
        self.index, self.name = index, f"line_{index}"

    def rows(self, model: Model) -> list[TaskRow]:
        """Two rows: error at the tip [1/s^2] and angle [rad/s^2]."""
        line, weights, acceleration = line_state(model, self.index), model.weights, model.camera_acceleration
        return [
            TaskRow(
                name=self.name,
                unit="1/s^2",
                expression=self.error_row(model) @ acceleration,
                target=self.target(model),
                weight=weights.line * line.weight,
            ),
            TaskRow(
                name=f"{self.name}_angle",
                unit="rad/s^2",
                expression=line.row_theta @ acceleration,
                target=line.angle_command,
                weight=weights.line_angle * line.weight,
            ),
        ]

    def error_row(self, model: Model) -> ca.SX:
        """Row of the error, (1, 6)."""
        line = line_state(model, self.index)
        return endpoint_line_row((line.row_rho, line.row_theta), model.lines[self.index].theta, model.view.tip)

    def target(self, model: Model) -> ca.SX:
        """Image acceleration of the error [1/s^2]."""
        line, row = line_state(model, self.index), self.error_row(model) @ model.camera_acceleration
        return image_command(model, row, line.error, line.rate, line.integral)


def _along_wall(model: Model) -> ca.SX:
    """Acceleration without the part of a push, which the wall takes, (6,)."""
    linear = model.acceleration[:3]
    pushed = model.contact_weight * ca.dot(model.normal, linear) * model.normal
    return ca.vertcat(linear - pushed, model.acceleration[3:])


def image_command(model: Model, row: ca.SX, error: ca.SX, rate: ca.SX, integral: ca.SX) -> ca.SX:
    """Image acceleration by the law of a line [1/s^2]; ``row`` is the acceleration that the thrusts give it."""
    gains = model.gains
    ahead = rate + gains.line_lead_s * model.at(row, model.acceleration_now)
    command = -(gains.line_kp * error + gains.line_kd * ahead + gains.line_ki * integral)
    return model.filtered(command, row, gains.line_filter_s)


def line_state(model: Model, index: int) -> LineState:
    """Errors, rates and weight of a line."""
    return model.once(("line", index), lambda: _line_state(model, model.lines[index]))


def _line_state(model: Model, line: Line) -> LineState:
    view, weights = model.view, model.weights
    (x_tip, y_tip), (right, below) = view.tip, view.tip_place
    cos, sin = ca.cos(line.theta), ca.sin(line.theta)
    nominal = (right * ca.cos(line.theta_reference) + below * ca.sin(line.theta_reference)) / view.depth
    reference = line.rho_reference - nominal
    error = line.rho - (x_tip * cos + y_tip * sin) - reference
    row_rho, row_theta = symbolic_line_rows(line.rho, line.theta, view.plane)
    row = endpoint_line_row((row_rho, row_theta), line.theta, view.tip)
    moving, filtered = model.body.velocity_known, _differentiated(model, line, error, row @ view.relative_twist)
    bounded = clamp(error, -ERROR_BOUND, ERROR_BOUND)
    integral = _integral(model, line, bounded)
    rho_error = clamp(line.rho - line.rho_reference, -ERROR_BOUND, ERROR_BOUND)
    rho_rate = ca.if_else(moving, row_rho @ view.relative_twist, filtered)
    analytic_row = (row if model.config.analytic_line_point == "tip" else row_rho) @ model.camera_twist
    followed = (bounded, filtered) if model.config.analytic_line_point == "tip" else (rho_error, rho_rate)
    angle_error, angle_rate = line.theta - line.theta_reference, ca.if_else(moving, row_theta @ view.twist, 0.0)
    state = LineState(
        row_rho=row_rho,
        row_theta=row_theta,
        error=bounded,
        rate=filtered,
        integral=integral,
        rho_error=rho_error,
        rho_rate=rho_rate,
        analytic_row=analytic_row,
        analytic_command=image_command(model, analytic_row @ _along_wall(model), *followed, integral),
        angle_error=angle_error,
        angle_rate=angle_rate,
        angle_command=-(model.gains.theta_kp * angle_error + model.gains.theta_kd * angle_rate),
        image_rate=ca.if_else(moving, row_rho @ view.twist, filtered),
        weight=line.present * line.confidence / (1.0 + ca.fmax(line.variance, 0.0) / weights.line_sigma**2),
    )
    for name in LINE_OUTPUTS:
        model.output(f"line_{line.index}.{name}", getattr(state, name))
    return state


def _differentiated(model: Model, line: Line, error: ca.SX, rate: ca.SX) -> ca.SX:
    """Rate of the error: from the camera's motion, or differentiated and filtered while no velocity is known."""
    name, dt = f"line_{line.index}_last", model.body.dt
    last_error, last_rate, seen = ca.vertsplit(model.signals.state(name, 3))
    step = (error - ca.if_else(seen, last_error, error)) / ca.fmax(dt, LEAST_STEP)
    filtered = last_rate + ca.fmin(1.0, dt / RATE_FILTER) * (step - last_rate)
    rate = ca.if_else(model.body.velocity_known, rate, filtered)
    now, before = ca.vertcat(error, rate, 1.0), ca.vertcat(last_error, last_rate, seen)
    model.signals.remember(name, ca.if_else(line.present, now, before))
    return rate


def _integral(model: Model, line: Line, error: ca.SX) -> ca.SX:
    """Integral of the bounded error; it stops while the line is absent, the tip stuck or a thrust limited."""
    gain, name = model.gains.line_ki, f"line_{line.index}_integral"
    integral = model.signals.state(name)
    bound = INTEGRAL_BOUND / ca.fmax(gain, LEAST_GAIN)
    moved = clamp(integral + model.body.dt * error * line.confidence, -bound, bound)
    integrate = ca.logic_and(line.present, model.integrate_in_plane)
    return model.signals.remember(name, ca.if_else(integrate, moved, integral))


def free_directions(model: Model) -> ca.SX:
    """Fraction of the directions right and down that no line fixes, (2,)."""

    def compute() -> ca.SX:
        right = down = ca.SX(0.0)
        for line in model.lines:
            weight = line_state(model, line.index).weight
            right = ca.fmax(right, line.vertical * weight)
            down = ca.fmax(down, (1.0 - line.vertical) * weight)
        return model.output("free", ca.vertcat(1.0 - right, 1.0 - down))

    return model.once(("free directions",), compute)
