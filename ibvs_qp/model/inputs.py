"""What the blocks of a tick read: the body, the contact and the wish, as symbols."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ibvs_qp.model.signals import Signals

#: Inputs that come as arrays, in the order in which a tick is packed.
ARRAYS = {"attitude": 4, "angular_velocity": 3, "contact_wrench": 6, "specific_force": 3, "velocity": 3, "normal": 3}
#: Entries of the input "touch", in this order.
TOUCH = ("known", "distance", "rate", "acceleration", "push", "noise", "across_noise", "touching", "ramp")
TOUCH += ("stiffness", "stiffness_known")
#: Entries of the input "reference": push, stand-off, velocity (2), press, roll, pitch, travel (2).
REFERENCE_INPUTS = 9
#: Entries of a line slot's input: present, rho, theta, its reference's rho and theta, weight, variance of rho.
SLOT_INPUTS = 7


def packed_inputs(signals: Signals, line_slots: int) -> None:
    """Ask for everything that is packed every tick, arrays first, then single numbers: one block."""
    for name, size in ARRAYS.items():
        signals.input(name, size)
    for name in ("dt", "felt", "moving", "contact_weight"):
        signals.input(name)
    signals.input("touch", len(TOUCH))
    signals.input("reference", REFERENCE_INPUTS)
    signals.input("vertical", line_slots)
    for slot in range(line_slots):
        signals.input(f"line_{slot}", SLOT_INPUTS)


@dataclass(frozen=True, kw_only=True)
class Body:
    """Inertial state and forces at this tick, in B.

    Attributes:
        dt: Time since the last tick [s].
        down: Unit gravity.
        rate: Angular velocity [rad/s].
        specific_force: Accelerometer [m/s^2]; felt: 1 if there is one.
        wrench: Tared contact wrench on the vehicle [N, N m].
        velocity: Linear velocity [m/s]; moving: 1 if it is known.
    """

    dt: ca.SX
    down: ca.SX
    rate: ca.SX
    specific_force: ca.SX
    felt: ca.SX
    wrench: ca.SX
    velocity: ca.SX
    moving: ca.SX

    @classmethod
    def of(cls, signals: Signals) -> Body:
        """Ask for the inputs."""
        w, x, y, z = ca.vertsplit(signals.input("attitude", 4))
        return cls(
            dt=signals.input("dt"),
            down=ca.vertcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
            rate=signals.input("angular_velocity", 3),
            specific_force=signals.input("specific_force", 3),
            felt=signals.input("felt"),
            wrench=signals.input("contact_wrench", 6),
            velocity=signals.input("velocity", 3),
            moving=signals.input("moving"),
        )

    def velocity_of(self, point: tuple[float, float, float]) -> ca.SX:
        r"""Velocity of a point of the body, :math:`v + \Omega \times p` [m/s], (3,).

        Args:
            point: The point, in B [m].
        """
        return self.velocity + ca.cross(self.rate, ca.DM(point))


@dataclass(frozen=True, kw_only=True)
class Touch:
    """The wall and the contact as estimated (`ibvs_qp.estimation.contact`).

    Attributes:
        known: 1 once the wall was seen.
        normal: Unit vector into the wall, in B.
        distance: Tip to wall [m]; rate: its rate [m/s]; acceleration: the rate's own [m/s^2].
        push: Filtered push [N]; noise: its deviation in free flight [N].
        across_noise: Deviation of the moments in free flight, as a force across the tip [N].
        touching: 1 in contact.
        ramp: 0 at touch to 1.
        stiffness: [N/m]; stiffness_known: 1 once it was measured.
    """

    known: ca.SX
    normal: ca.SX
    distance: ca.SX
    rate: ca.SX
    acceleration: ca.SX
    push: ca.SX
    noise: ca.SX
    across_noise: ca.SX
    touching: ca.SX
    ramp: ca.SX
    stiffness: ca.SX
    stiffness_known: ca.SX

    @classmethod
    def of(cls, signals: Signals) -> Touch:
        """Ask for the inputs."""
        symbols = ca.vertsplit(signals.input("touch", len(TOUCH)))
        return cls(normal=signals.input("normal", 3), **dict(zip(TOUCH, symbols, strict=True)))


@dataclass(frozen=True, kw_only=True)
class Wish:
    """The reference.

    Attributes:
        push: [N]; press: whether to; standoff: [m].
        velocity: Right and down [m/s]; plan: the one that is planned.
        tilt: Roll and pitch [rad].
    """

    push: ca.SX
    standoff: ca.SX
    velocity: ca.SX
    press: ca.SX
    tilt: ca.SX
    plan: ca.SX

    @classmethod
    def of(cls, signals: Signals) -> Wish:
        """Ask for the inputs."""
        entries = ca.vertsplit(signals.input("reference", REFERENCE_INPUTS))
        push, standoff, right, down, press, roll, pitch, *plan = entries
        velocity, tilt = ca.vertcat(right, down), ca.vertcat(roll, pitch)
        return cls(push=push, standoff=standoff, velocity=velocity, press=press, tilt=tilt, plan=ca.vertcat(*plan))


def clamp(value: ca.SX, low: float | ca.SX, high: float | ca.SX) -> ca.SX:
    """Value limited to [low, high], entry by entry."""
    return ca.fmin(ca.fmax(value, low), high)
