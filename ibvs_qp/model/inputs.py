"""Inputs of the law at the present, as symbols: body, contact, reference and lines.

`ibvs_qp.model.tick` computes them from the sensors.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ibvs_qp.config import ControllerConfig, Gains, LimitSettings, SolverSettings, Weights
from ibvs_qp.symbolic.signals import Signals

#: Gain of an integral in the division that bounds it: one of zero has a bound as well.
LEAST_GAIN = 1e-6


@dataclass(frozen=True, kw_only=True)
class Body:
    """Inertial state and forces, in B.

    Attributes:
        dt: Time since the last step [s].
        down: Unit gravity.
        gyro: Angular velocity as measured [rad/s].
        rate: Angular velocity [rad/s]: the gyro's, in a model the estimated one (`ibvs_qp.model.angular_rate`).
        specific_force: Accelerometer [m/s^2]; specific_force_known: 1 if measured.
        wrench: Tared contact wrench on the vehicle [N, N m].
        velocity: Linear velocity [m/s]; velocity_known: 1 if estimated.
        acceleration_bias: Measured minus true acceleration [m/s^2]; its part along the wall counts.
    """

    dt: ca.SX
    down: ca.SX
    gyro: ca.SX
    rate: ca.SX
    specific_force: ca.SX
    specific_force_known: ca.SX
    wrench: ca.SX
    velocity: ca.SX
    velocity_known: ca.SX
    acceleration_bias: ca.SX

    @classmethod
    def of(cls, signals: Signals) -> Body:
        """Declare the inputs."""
        gyro = signals.input("angular_velocity", 3)
        return cls(
            dt=signals.input("dt"),
            down=gravity_direction(signals.input("attitude", 4)),
            gyro=gyro,
            rate=gyro,
            specific_force=signals.input("specific_force", 3),
            specific_force_known=signals.input("specific_force_known"),
            wrench=signals.input("contact_wrench", 6),
            velocity=signals.input("velocity", 3),
            velocity_known=signals.input("velocity_known"),
            acceleration_bias=signals.input("acceleration_bias", 3),
        )

    def velocity_of(self, point: tuple[float, float, float]) -> ca.SX:
        r"""Velocity of a point of the body, :math:`v + \Omega \times p` [m/s], (3,).

        Args:
            point: The point, in B [m].
        """
        return self.velocity + ca.cross(self.rate, ca.DM(point))


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Wall and contact as estimated (`ibvs_qp.estimation.contact`).

    Attributes:
        known: 1 once the wall was seen.
        distance: Tip to wall [m]; rate: its rate [m/s]; acceleration: its second derivative [m/s^2].
        rate_noise: Standard deviation of the rate [m/s]; acceleration_noise: of an accelerometer sample [m/s^2].
        bias: Measured minus true acceleration along n [m/s^2].
        push: Filtered push [N]; push_noise: its standard deviation in free flight [N].
        moment_noise: Standard deviation of the moments in free flight, as a force across the tip [N].
        touching: 1 in contact.
        ramp: 0 at touch to 1.
        stiffness: [N/m]; stiffness_known: 1 once measured.
        normal: Unit vector into the wall, in B.
    """

    known: ca.SX
    distance: ca.SX
    rate: ca.SX
    acceleration: ca.SX
    rate_noise: ca.SX
    acceleration_noise: ca.SX
    bias: ca.SX
    push: ca.SX
    push_noise: ca.SX
    moment_noise: ca.SX
    touching: ca.SX
    ramp: ca.SX
    stiffness: ca.SX
    stiffness_known: ca.SX
    normal: ca.SX

    @classmethod
    def of(cls, signals: Signals) -> Contact:
        """Declare the inputs."""
        scalars = {name: signals.input(f"contact.{name}") for name in CONTACT}
        return cls(normal=signals.input("normal", 3), **scalars)


@dataclass(frozen=True, kw_only=True)
class Target:
    """The reference.

    Attributes:
        push: Push force [N].
        standoff: Tip to wall out of contact [m].
        velocity_right, velocity_down: In the wall plane [m/s].
        press: 1 to press the wall.
        roll, pitch: Attitude [rad]; zero but for a vehicle that lost a rotor.
        travel_right, travel_down: Velocity planned at this push [m/s].
        trim_roll, trim_pitch: Attitude of a level hover with a limited rotor [rad].
    """

    push: ca.SX
    standoff: ca.SX
    velocity_right: ca.SX
    velocity_down: ca.SX
    press: ca.SX
    roll: ca.SX
    pitch: ca.SX
    travel_right: ca.SX
    travel_down: ca.SX
    trim_roll: ca.SX
    trim_pitch: ca.SX

    @classmethod
    def of(cls, signals: Signals) -> Target:
        """Declare the inputs."""
        return cls(**{name: signals.input(f"reference.{name}") for name in TARGET})


@dataclass(frozen=True, kw_only=True)
class Line:
    """One measured line and its reference; rows of an absent line have weight zero.

    Attributes:
        index: Of the line; its reference keeps it from step to step.
        present: 1 if measured; vertical: 1 for a vertical line, 0 for a horizontal one.
        rho, theta: Of the line, its sign aligned with the reference.
        rho_reference, theta_reference: Of the reference.
        confidence: Weight of the feature, 0 to 1; variance: of rho.
    """

    index: int
    present: ca.SX
    vertical: ca.SX
    rho: ca.SX
    theta: ca.SX
    rho_reference: ca.SX
    theta_reference: ca.SX
    confidence: ca.SX
    variance: ca.SX

    @classmethod
    def of(cls, signals: Signals, index: int) -> Line:
        """Declare the inputs of one line."""
        return cls(index=index, **{name: signals.input(f"line_{index}.{name}") for name in LINE})


def _names(kind: type, but: str = "") -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind) if field.name != but)


#: Scalar inputs of contact, reference and every line.
CONTACT, TARGET, LINE = _names(Contact, "normal"), _names(Target), _names(Line, "index")
#: Outputs of every line, "line_0.error" and so on (`ibvs_qp.tasks.line.LineState`).
LINE_OUTPUTS = (
    "error rate integral rho_error rho_rate analytic_command angle_error angle_rate angle_command weight".split()
)


#: Settings that decide which equations there are: constants of the program.
STRUCTURAL = ("trim_deg", "view_rotation", "hard_barriers")
#: Settings that are inputs of the tick: gains, weights, and bounds, slack weights and switches of the limits.
RUN_TIME = {
    "gains": _names(Gains),
    "weights": _names(Weights),
    "limits": tuple(name for name in _names(LimitSettings) if name not in STRUCTURAL),
}


def gravity_direction(attitude: ca.SX) -> ca.SX:
    """Unit gravity in B, (3,), by a quaternion; see `ibvs_qp.frames.down_in_body`."""
    w, x, y, z = ca.vertsplit(attitude)
    return ca.vertcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))


def equations(config: ControllerConfig) -> ControllerConfig:
    """What determines the equations: a configuration with the defaults of all that are inputs of the tick."""
    switches = [name for name in RUN_TIME["limits"] if name.endswith("_barrier")]
    limits = LimitSettings(**{name: getattr(config.limits, name) for name in (*STRUCTURAL, *switches)})
    return replace(config, gains=Gains(), weights=Weights(), limits=limits, solver=SolverSettings())


def setting_inputs(signals: Signals, section: str) -> Any:
    """Symbols of a section of the settings under the names of its fields: they may change at run time."""
    return SimpleNamespace(**{name: signals.input(f"{section}.{name}") for name in RUN_TIME[section]})


def setting_values(config: ControllerConfig) -> dict[str, float]:
    """Values of all settings that may change at run time, by the names of their inputs."""
    sections = ((section, getattr(config, section), names) for section, names in RUN_TIME.items())
    return {f"{section}.{name}": getattr(values, name) for section, values, names in sections for name in names}


def clamp(value: ca.SX, low: float | ca.SX, high: float | ca.SX) -> ca.SX:
    """Value limited to [low, high], entry by entry."""
    return ca.fmin(ca.fmax(value, low), high)
