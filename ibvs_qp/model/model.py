"""The symbolic model common to tasks, limits and both laws: one object per controller."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from allocation import control_effectiveness
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.contact import LEAST_PUSH_DENSITY
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.estimation.attitude import estimated_rate
from ibvs_qp.estimation.external_wrench import external_wrench
from ibvs_qp.estimation.friction import cautious_friction, estimated_friction
from ibvs_qp.estimation.inputs import Body, Contact, motor_thrust
from ibvs_qp.estimation.push_disturbance import Normal, PushDisturbance
from ibvs_qp.estimation.response import carried_weight, inertial_push, missing_thrust
from ibvs_qp.estimation.wall_lines import WallAxes
from ibvs_qp.frames import GRAVITY, camera_twist_matrix
from ibvs_qp.model.feedforward import SLIDING_COMMAND, contact_feedforward
from ibvs_qp.model.geometry import attitude, camera_view
from ibvs_qp.model.inputs import RUN_TIME, Line, Target, setting_inputs
from ibvs_qp.model.reach import STANDING_SPEED, push_planes, push_reach, push_reference, thrust_window
from ibvs_qp.model.rows import Parameter
from ibvs_qp.model.trim_tilt import TrimTilt
from ibvs_qp.symbolic.signals import Signals

T = TypeVar("T")

#: Unallocated force or moment of the last step above which integrals stop [N, N m].
WINDUP_WRENCH = 0.5
#: A row filter below this is off [s]: the exponent stays finite.
LEAST_FILTER = 1e-5


class Model:
    r"""Thrusts u, the acceleration :math:`\dot\nu(u) = M^{-1}(B u + h)`, and the quantities of a step.

    The bias wrench h is the sum of gravity, the gyroscopic moment, the observed external wrench and the contact
    feed-forward. Rows are written in `thrust` and `acceleration`; `ibvs_qp.qp.problem` eliminates the acceleration.

    Args:
        config: Everything it needs; its gains, weights and limits are inputs ``gains.line_kp`` and so on.

    Attributes:
        gains, weights, limits: Symbols under the names of the settings (`ibvs_qp.model.inputs.RUN_TIME`).
        thrust: u [N], (n,).
        acceleration: nu_dot in B [m/s^2, rad/s^2], (6,).
        acceleration_now: nu_dot of the lagged thrusts; acceleration_commanded: of the last command, (6,).
        wrench: M nu_dot, the net wrench without contact [N, N m], (6,).
        body, contact, target, lines: Inputs (`ibvs_qp.model.inputs`).
        wall: Axes of the wall in B.
        attitude: Angles and rates.
        rate_ahead: Angular velocity after ``angular_rate.lead_s`` [rad/s], (3,).
        view: Wall and tip in the picture.
        travel: Commanded velocity in the wall plane, in B [m/s], (3,).
        contact_weight: Lambda, 0 in free air to 1 in contact.
        tip_stationary: 1 for a tip in contact that is commanded to stay.
        push_disturbance: Push, rate and disturbing forces along n in contact.
        bias_wrench: h [N, N m], (6,).
        reach: Largest push that the thrust limits allow [N].
        push_reference: Push reference within reach [N].
        code: Functions of the equations, common to all copies.
        integrate: 1 while no limit takes wrench away: anti-windup of all integrals.
        integrate_in_plane: The same for integrals in the wall plane, which also stop while the tip is stuck.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self.config, self.signals, self.parameters = config, Signals(), list[Parameter]()
        self._cache, self.code = dict[tuple[object, ...], object](), dict[tuple[object, ...], Any]()
        vehicle, signals = config.vehicle, self.signals
        body, self.contact, self.target = Body.of(signals), Contact.of(signals), Target.of(signals)
        self.lines = [Line.of(signals, index) for index in range(config.line_slots)]
        self.contact_weight = signals.input("contact_weight")
        self.gains, self.weights, self.limits = (setting_inputs(signals, section) for section in RUN_TIME)

        self.rotors = vehicle.geometry.count
        self.effectiveness = control_effectiveness(vehicle.geometry)
        self.thrust = ca.SX.sym("thrust", self.rotors)
        self.acceleration = ca.SX.sym("acceleration", 6)
        self.wrench = ca.sparsify(vehicle.mass_matrix) @ self.acceleration

        self._motors = motor_thrust(signals, vehicle, body.dt)
        rate, angular_acceleration = estimated_rate(signals, config, self.effectiveness, body, self._motors)
        self.output("angular_acceleration", angular_acceleration)
        self.body = dataclasses.replace(body, rate=rate)
        self.rate_ahead = rate + config.angular_rate.lead_s * angular_acceleration
        self.wall = WallAxes.of_symbols(self.contact.normal, self.body.down)
        bandwidth = config.angular_rate.attitude_bandwidth_hz
        target, trim = self.target, TrimTilt(signals, config)
        self.attitude = attitude(signals, self.body, self.contact, target, self.rate_ahead, bandwidth, trim.angles)
        velocity = ca.vertcat(target.velocity_right, target.velocity_down)
        self.travel = self.wall.in_body(target.velocity_right, target.velocity_down)
        self.tip_stationary = ca.logic_and(self.contact.touching, ca.norm_2(velocity) <= SLIDING_COMMAND)
        self.view = camera_view(vehicle, self.body, self.contact, self.travel)
        self.integrate = signals.input("unallocated") < WINDUP_WRENCH
        self.integrate_in_plane = ca.logic_and(ca.logic_not(self._stuck()), self.integrate)

        static_wrench, friction = self._disturbances()
        inverse_mass = np.linalg.inv(vehicle.mass_matrix)
        self.acceleration_per_thrust = ca.DM(inverse_mass @ self.effectiveness)
        self.free_acceleration = ca.sparsify(inverse_mass) @ self.bias_wrench
        self._rotor_limits()
        flying = self._motors.ready  # before the first command the thrusts are unknown
        self.acceleration_now = ca.if_else(flying, self.acceleration_of(self._motors.thrusts), 0.0)
        self.acceleration_commanded = self.acceleration_of(self.last_thrust)
        planned = self.wall.in_body(target.travel_right, target.travel_down)
        ahead = ca.if_else(ca.norm_2(self.travel) > STANDING_SPEED, self.travel, planned)
        planes = push_planes(signals, vehicle, self.wall.normal, ahead, friction, static_wrench)
        self.reach = push_reach(signals, planes)
        trim.update(planes, self.body, self.contact, target)
        self.push_reference = push_reference(signals, config, self.body, self.contact, target, self.reach)
        self._name_outputs()

    def of(self, config: ControllerConfig) -> Model:
        """A copy for a configuration with the same equations; declarations in the copy stay in it."""
        other = copy.copy(self)
        other.config, other.signals, other.parameters = config, self.signals.copy(), list(self.parameters)
        other._cache = dict(self._cache)
        return other

    def built(self, key: tuple[object, ...], build: Callable[[], T]) -> T:
        """Function of the complete equations, built once for all copies (`of`)."""
        if key not in self.code:
            self.code[key] = build()
        return self.code[key]

    def _stuck(self) -> ca.SX:
        # The body's velocity, not the tip's: a tip creeping at high friction must not stop the integral that frees it.
        body, normal = self.body, self.wall.normal
        in_plane = body.velocity - normal * ca.dot(normal, body.velocity)
        slow = ca.norm_2(in_plane) * body.velocity_known < self.config.contact.stuck_speed_m_s
        return ca.logic_and(self.contact.touching, slow)

    def _disturbances(self) -> tuple[ca.SX, ca.SX]:
        """Set the bias wrench; its part without contact, and the friction coefficient that the reach assumes."""
        signals, config, vehicle = self.signals, self.config, self.config.vehicle
        body, contact = self.body, self.contact
        tip = body.velocity_of(vehicle.tip_position_m)
        before, friction = estimated_friction(signals, config.contact, body, contact, tip, self.travel, SLIDING_COMMAND)
        signals.output("friction", friction)
        expected, felt_moment = ca.SX.zeros(6), ca.SX.zeros(3)
        if config.contact_feedforward:
            forward = contact_feedforward(signals, config, body, contact, self.travel, before)
            expected, felt_moment = ca.vertcat(forward.force, forward.moment), forward.felt_moment
        # Only a tip that shall touch: subtracting a drifted force would hold a retreating vehicle at the wall.
        landing = ca.logic_and(self.target.press, contact.distance < config.contact.contact_distance_m)
        near = ca.logic_or(contact.touching, landing)
        normal, along = self.wall.normal, body.acceleration_bias
        push = self.push_disturbance = self._along_normal()
        external = external_wrench(
            signals, config, self.effectiveness, body, felt_moment, normal, near, contact, self._motors, push.external
        )
        inertial_push(signals, config, self.effectiveness, body, contact, self._motors)
        carried_weight(signals, config, self.effectiveness, body, self._motors)
        missing_thrust(signals, config, self.effectiveness, body, felt_moment, self._motors)
        motors = ca.DM(self.effectiveness[:3]) @ self._motors.thrusts
        self.output("motors_force", motors / vehicle.mass_kg)
        self.output("modelled_force", (motors + body.wrench[:3] + external[:3]) / vehicle.mass_kg)
        gyroscopic = -ca.cross(body.rate, ca.sparsify(vehicle.inertia) @ body.rate)
        # The observer takes the accelerometer's bias for a force, and gravity leaks through the attitude's error.
        bias = contact.bias * normal + along - normal * ca.dot(normal, along)
        unreal = ca.vertcat(vehicle.mass_kg * bias, ca.DM.zeros(3))
        static = ca.vertcat(vehicle.mass_kg * GRAVITY * body.down, gyroscopic) + external - unreal
        self.bias_wrench = static + expected
        return static, cautious_friction(signals, friction, config.contact.assumed_friction)

    def _along_normal(self) -> PushDisturbance:
        config, body, contact, motors = self.config, self.body, self.contact, self._motors
        mass, normal = config.vehicle.mass_kg, self.wall.normal
        filter_rad_s = 2.0 * math.pi * config.contact.force_filter_hz
        quiet = config.contact.estimation.acceleration_noise / math.sqrt(config.tick_s)
        return PushDisturbance(
            self.signals,
            config,
            Normal(
                dt=body.dt,
                touching=ca.logic_and(motors.ready, contact.touching),
                felt=body.specific_force_known,
                thrust=ca.dot(normal, ca.DM(self.effectiveness[:3]) @ motors.thrusts),
                weight=mass * GRAVITY * ca.dot(normal, body.down),
                inertial=mass * ca.dot(normal, body.specific_force),
                push=-ca.dot(normal, body.wrench[:3]),
                push_density=2.0 * contact.push_noise**2 / filter_rad_s + LEAST_PUSH_DENSITY,
                vibration=mass * ca.sqrt(contact.acceleration_noise**2 + quiet**2),
                stiffness=contact.stiffness,
                stiffness_known=contact.stiffness_known,
                rate=-contact.rate,
                rate_std=contact.rate_noise,
                external=ca.dot(normal, self.signals.state("external_force", 3)),
                bias=contact.bias,
            ),
        )

    def _rotor_limits(self) -> None:
        """Thrust window of the step, and the last thrusts and where their last change would lead [N], (n,) each."""
        signals, count = self.signals, self.rotors
        self.last_thrust, change = signals.input("thrust_last", count), signals.input("thrust_change", count)
        low, high, floor, ceiling = (
            signals.input(f"thrust_{name}", count) for name in "low high floor ceiling".split()
        )
        self.thrust_limits, self.thrust_box = (low, high), (floor, ceiling)
        step = signals.input("thrust_step")
        self.thrust_lower, self.thrust_upper = thrust_window(self.last_thrust, low, high, step, floor, ceiling)
        self.extrapolated_thrust = ca.fmin(ca.fmax(self.last_thrust + change, self.thrust_lower), self.thrust_upper)

    def _name_outputs(self) -> None:
        angles = ca.vertcat(self.attitude.roll, self.attitude.pitch, self.attitude.yaw)
        for name, value in {
            "normal": self.wall.normal,
            "axis_right": self.wall.right,
            "axis_down": self.wall.down,
            "plane": self.view.plane,
            "tip_image": ca.vertcat(*self.view.tip),
            "angles": angles,
            "bias_wrench": self.bias_wrench,
            "thrust_lower": self.thrust_lower,
            "thrust_upper": self.thrust_upper,
            "contact_weight": self.contact_weight,
            "turning_lever": self.turning_lever,
        }.items():
            self.output(name, value)

    def acceleration_of(self, thrusts: ca.SX) -> ca.SX:
        r"""Acceleration :math:`\dot\nu = M^{-1}(B u + h)` of given thrusts [m/s^2, rad/s^2], (6,)."""
        return self.acceleration_per_thrust @ thrusts + self.free_acceleration

    def at(self, row: ca.SX, acceleration: ca.SX) -> ca.SX:
        """Value of a row, linear in `acceleration`, at another acceleration."""
        # The Jacobian shares the row's nodes; ca.substitute would copy its graph.
        return ca.jacobian(row, self.acceleration) @ acceleration

    def filtered(self, target: ca.SX, row: ca.SX, time_s: ca.SX) -> ca.SX:
        r"""Target of a row behind a filter that starts at the last achieved command.

        .. math:: t + k_u (J \dot\nu_{commanded} - t), \qquad k_u = e^{-\Delta t / T}

        The command is the one within the limits, so that a filter never winds up.

        Args:
            target: t, in the unit of the row.
            row: :math:`J \dot\nu`.
            time_s: T [s]; 0 is no filter.
        """
        return target + self.filter_share(time_s) * (self.at(row, self.acceleration_commanded) - target)

    def filter_share(self, time_s: ca.SX) -> ca.SX:
        """Share :math:`k_u` of the last command in a target behind a filter [-]."""
        return ca.exp(-self.config.tick_s / ca.fmax(time_s, LEAST_FILTER))

    @property
    def normal(self) -> ca.SX:
        """Unit vector into the wall, in B, (3,)."""
        return self.wall.normal

    @property
    def force_along_normal(self) -> ca.SX:
        """Mass times the acceleration along n without contact, as a function of the thrusts [N].

        In contact with a leaning wall it is the tip's, else that of the centre of mass.
        """
        turning = ca.dot(self.turning_lever, self.acceleration[3:])
        return ca.dot(self.normal, self.wrench[:3]) + self.contact_weight * turning

    @property
    def turning_lever(self) -> ca.SX:
        r"""Mass times the acceleration along n per angular acceleration of a tip on a leaning wall [kg m], (3,).

        .. math:: m (n^T d) (r \times d)

        with the tip r and gravity's direction d. A level vehicle has this lever. That of a tilt is left out: the rows
        of roll and pitch keep tilts small, and the push shall not turn the vehicle before an upright wall.
        """
        vehicle, down = self.config.vehicle, self.body.down
        lean = ca.dot(self.wall.normal, down)
        return vehicle.mass_kg * lean * ca.cross(ca.DM(vehicle.tip_position_m), down)

    @property
    def body_rotation_gain(self) -> ca.SX:
        r"""Fraction of the body's rotation in line rows: :math:`1 - \lambda (1 - r)` while the tip travels, r the gain.

        A tip stuck by friction does not follow the body's rotation; a row that expects it trades vertical force for
        pitch. While the tip is commanded to stay, use the full row: a reduced gain makes the horizontal line command
        vertical motion (with r = 0.05, a command of 35 N beyond reach loses 6 N of 30.1 N).
        """
        if self.config.line_profile == "paper":
            return ca.SX(1.0)
        reduction = 1.0 - self.gains.body_rotation_gain
        return 1.0 - self.contact_weight * (1.0 - self.tip_stationary) * reduction

    @property
    def camera_acceleration(self) -> ca.SX:
        r"""Acceleration of the camera that lines may use, :math:`T S \dot\nu`, S = blockdiag(I - s n n^T, r I), (6,).

        s = 1: the image never uses the pushing direction (the paper's profile takes s = lambda);
        r is `body_rotation_gain`; T maps body to camera twists.
        """
        along = self.contact_weight if self.config.line_profile == "paper" else ca.SX(1.0)
        linear, angular = self.acceleration[:3], self.acceleration[3:]
        linear = linear - self.normal * (along * ca.dot(self.normal, linear))
        return self.camera_twist @ ca.vertcat(linear, self.body_rotation_gain * angular)

    def pivot_limited(self, stiffness: Any, pivot: Any, guides: Sequence[ca.SX]) -> ca.SX:
        """Stiffness of an axis [1/s^2], reduced while friction alone holds the tip.

        Args:
            stiffness: Of a free vehicle [1/s^2].
            pivot: Of a vehicle that turns about its tip, by `pivot_stiffness` [1/s^2].
            guides: For every line 1 if it fixes the place of the tip across this axis.
        """
        if not self.config.contact_feedforward:
            return ca.SX(stiffness)
        guided = ca.SX(0.0)
        for line, guide in zip(self.lines, guides, strict=True):
            guided = ca.fmax(guided, guide * line.present * line.confidence)
        return stiffness + self.tip_stationary * (1.0 - guided) * (ca.fmin(stiffness, pivot) - stiffness)

    @property
    def camera_twist(self) -> ca.DM:
        """T, (6, 6): body twist to camera twist."""
        return ca.DM(camera_twist_matrix(np.array(self.config.vehicle.camera_position_m)))

    def parameter(self, parameter: Parameter) -> ca.SX:
        """Symbol of a number that a task or limit of a user changes between steps; see `Parameter`."""
        if parameter not in self.parameters:
            if parameter.name in self.signals.inputs:
                raise ConfigError(f"parameter {parameter.name!r} exists already: choose another name")
            self.parameters.append(parameter)
        return self.signals.input(parameter.name, parameter.value.size)

    def output(self, name: str, value: ca.SX) -> ca.SX:
        """Name a result of the step; returns it."""
        return self.signals.output(name, value)

    def once(self, key: tuple[object, ...], compute: Callable[[], T]) -> T:
        """Result of an equation that several rows share; its states are declared once."""
        if key not in self._cache:
            self._cache[key] = compute()
        return self._cache[key]  # type: ignore[return-value]
