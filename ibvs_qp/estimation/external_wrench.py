"""Observer of the unmodelled wrench: wrong mass, shifted centre of mass, wind."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.config import ControllerConfig, VehicleParams
from ibvs_qp.estimation.inputs import Body, Contact, MotorThrust
from ibvs_qp.estimation.push_disturbance import FORCE_BOUND, filter_gain, gust_weight
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.symbolic.signals import Signals

#: Bandwidth of the force observer in free flight, and in contact in the wall's plane in calm air [rad/s]; in gusts it
#: is `contact.plane_bandwidth_rad_s` there. In calm air a faster one mistakes changing friction for an external force:
#: at 4 rad/s the climb to row 4 lasts 1 s longer.
FORCE_BANDWIDTH_FREE, FORCE_BANDWIDTH_WALL = 4.0, 1.5
#: In calm air a fast observer only passes on sensor noise. In the plane its bandwidth halves where the force not yet
#: learnt is this strong [N rms], low-passed at its own bandwidth.
CALM_AIR = 0.1
#: Bandwidth of the moment observer [rad/s]; below the attitude loop so that the two do not fight.
MOMENT_BANDWIDTH = 2.5
#: The force observer averages evenly over this time at the start, then turns to its bandwidth [s].
START_TIME = 0.25
#: Largest plausible external moment [N m]; a larger one is a fault, not a load.
MOMENT_BOUND = 6.0


def external_wrench(
    signals: Signals,
    config: ControllerConfig,
    effectiveness: np.ndarray,
    body: Body,
    felt_moment: ca.SX,
    normal: ca.SX,
    touching: ca.SX,
    contact: Contact,
    motors: MotorThrust,
    along: ca.SX,
) -> ca.SX:
    r"""Momentum and accelerometer observer of the unmodelled wrench at the centre of mass [N, N m], (6,).

    Force: :math:`m f_{spec} - B_F \hat u - F_c`, low-passed, with the lagged thrusts :math:`\hat u` and the measured
    contact force F_c. Moment: first-order momentum observer of
    :math:`J\dot\Omega + \Omega\times J\Omega - B_M \hat u - M_{ff}` (De Luca and Mattone, 2003, without joint axes).
    In contact the measured force is subtracted in the wall's plane, and along the normal the force is that of
    `ibvs_qp.estimation.push_disturbance`. Without feed-forward the rest stands still in contact, because it would take
    contact moments for a load.

    ``felt_moment`` is the measured moment of the contact [N m], (3,), ``touching`` 1 in contact or just before it;
    of ``contact`` the accelerometer's noise counts; ``motors`` are the lagged thrusts, ``along`` the force along the
    normal in contact [N].
    """
    vehicle = config.vehicle
    rotors = ca.DM(effectiveness) @ motors.thrusts
    awake = ca.logic_and(motors.ready, body.dt > 0.0)
    active = awake if config.contact_feedforward else ca.logic_and(awake, ca.logic_not(touching))
    force = _force(signals, config, body, rotors[:3], normal, touching, contact, awake, active, along)
    moment = _moment(signals, vehicle, body, rotors[3:] + felt_moment, awake, active)
    return ca.vertcat(force, moment)


def _moment(signals: Signals, vehicle: VehicleParams, body: Body, known: ca.SX, awake: ca.SX, active: ca.SX) -> ca.SX:
    old, started = signals.state("external_moment", 3), signals.state("external_started")
    integral = signals.state("external_momentum", 3)
    momentum = ca.sparsify(vehicle.inertia) @ body.gyro
    begun = ca.if_else(started, integral, momentum - old / MOMENT_BANDWIDTH)
    moved = begun + body.dt * (known - ca.cross(body.gyro, momentum) + old)
    new = clamp(MOMENT_BANDWIDTH * (momentum - moved), -MOMENT_BOUND, MOMENT_BOUND)
    signals.remember("external_momentum", ca.if_else(active, moved, integral))
    signals.remember("external_started", ca.if_else(awake, active, started))
    return signals.remember("external_moment", ca.if_else(active, new, old))


def _force(
    signals: Signals,
    config: ControllerConfig,
    body: Body,
    rotors: ca.SX,
    normal: ca.SX,
    touching: ca.SX,
    contact: Contact,
    awake: ca.SX,
    active: ca.SX,
    along: ca.SX,
) -> ca.SX:
    old, time = signals.state("external_force", 3), signals.state("external_time")
    time = signals.remember("external_time", ca.if_else(awake, time + body.dt, time))
    free, fastest = config.vehicle.mass_kg * body.specific_force - rotors - old, config.contact.plane_bandwidth_rad_s
    felt = free - body.wrench[:3]
    across = _in_plane(felt, normal)
    vibration = config.vehicle.mass_kg * contact.acceleration_noise
    windy = _unlearnt_weight(signals, fastest, body.dt, touching * across, vibration)
    plane = FORCE_BANDWIDTH_WALL + (fastest - FORCE_BANDWIDTH_WALL) * windy
    in_air = filter_gain(FORCE_BANDWIDTH_FREE, body.dt)
    near = ca.dot(normal, old + in_air * felt) * normal
    learnt = near + _in_plane(old, normal) + filter_gain(plane, body.dt) * across
    average = ca.if_else(time < START_TIME, body.dt / ca.fmax(time, 1e-9), 0.0)
    step = ca.fmax(in_air, average) * free
    known = ca.logic_and(active, body.specific_force_known)
    new = ca.if_else(known, ca.if_else(touching, learnt, old + step), old)
    new = ca.if_else(contact.touching, along * normal + _in_plane(new, normal), new)
    return signals.remember("external_force", clamp(new, -FORCE_BOUND, FORCE_BOUND))


def _in_plane(force: ca.SX, normal: ca.SX) -> ca.SX:
    """Part of a force in the plane of the wall."""
    return force - ca.dot(normal, force) * normal


def _unlearnt_weight(signals: Signals, bandwidth: float, dt: ca.SX, unlearnt: ca.SX, vibration: ca.SX) -> ca.SX:
    """Weight of the observer in the wall's plane: 0 in calm air to 1 in gusts, by the power of the unlearnt force.

    Not by the changes of the whole force, which in the plane are those of friction as well.

    Args:
        signals: Registry.
        bandwidth: Of the observer in gusts [rad/s].
        dt: Time since the last step [s].
        unlearnt: Force in the plane, in B [N], (3,).
        vibration: Deviation of one sample of a component by the accelerometer's noise [N]: no gust.
    """
    smooth, gain = signals.state("plane_unlearnt", 3), filter_gain(bandwidth, dt)
    smooth = signals.remember("plane_unlearnt", smooth + gain * (unlearnt - smooth))
    return gust_weight(signals, "plane", dt, ca.sumsqr(smooth) / 2.0, vibration**2 * gain / (2.0 - gain), CALM_AIR)
