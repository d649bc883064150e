"""What pushes the vehicle beside its rotors, gravity and the felt contact: wrong mass, shifted centre, wind."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.analysis.contact_loop import GUST_BANDWIDTH
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.model.inputs import Body, clamp
from ibvs_qp.model.signals import Signals

#: Bandwidth of the force observer in free flight, and in contact in the wall's plane [rad/s]; along the normal it is
#: `ibvs_qp.analysis.contact_loop.GUST_BANDWIDTH`. In the plane a faster one mistakes changing friction for an external
#: force: at 4 rad/s the climb to row 4 lasts 1 s longer, and its fresh edge is lost.
FORCE_BANDWIDTH_FREE, FORCE_BANDWIDTH_WALL = 4.0, 1.5
#: In contact the force sensor's noise is handed on as force: the bandwidth along the normal halves at this filtered
#: noise [N].
QUIET_PUSH = 0.15
#: In calm air the observer along the normal only hands on the sensors' noise. Its bandwidth halves where what it has
#: not learnt yet is this strong [N rms], low-passed at its own bandwidth and averaged over this time [s].
CALM_AIR, CALM_TIME = 0.1, 0.5
#: Bandwidth of the moment observer [rad/s]; below the attitude loop so that the two do not fight.
MOMENT_BANDWIDTH = 2.5
#: The force observer averages evenly over this time at the start, then turns to its bandwidth [s].
START_TIME = 0.25
#: Largest believable external force and moment [N], [N m]; beyond it is a fault, not a load.
FORCE_BOUND, MOMENT_BOUND = 40.0, 6.0


def lagged_thrusts(signals: Signals, vehicle: VehicleParams, dt: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Thrusts that the motors give now [N], (n,), and 1 if anything was ever commanded."""
    count = vehicle.geometry.count
    last, commanded = signals.input("thrust_last", count), signals.input("commanded")
    thrusts, ready = signals.state("motor_thrust", count), signals.state("motor_ready")
    rise, fall = (1.0 - ca.exp(-dt / lag) for lag in (vehicle.motor_lag_up_s, vehicle.motor_lag_down_s))
    step = last - thrusts
    moved = ca.if_else(ready, thrusts + ca.if_else(step > 0.0, rise, fall) * step, last)
    return signals.remember("motor_thrust", moved), signals.remember("motor_ready", commanded)


def external_wrench(
    signals: Signals,
    vehicle: VehicleParams,
    effectiveness: np.ndarray,
    body: Body,
    felt_moment: ca.SX,
    normal: ca.SX,
    touching: ca.SX,
    noise: ca.SX,
    adapt_in_contact: bool,
) -> ca.SX:
    r"""Momentum and accelerometer observer of the unmodelled wrench at the centre of mass [N, N m], (6,).

    Force: :math:`m f_{spec} - B_F \hat u - F_c`, low-passed, with the lagged thrusts :math:`\hat u` and the measured
    contact force F_c. Moment: first-order momentum observer of
    :math:`J\dot\Omega + \Omega\times J\Omega - B_M \hat u - M_{ff}` (De Luca and Mattone, 2003, without joint axes).
    In contact the felt force is taken off, so that a gust along the normal is told from the wall's answer: with the
    true thrusts and force there is no loop through the wall. A gust of correlation time T_g and rms s then leaves a
    push error of :math:`s\sqrt{T/(T_g+T)}`, T being the observer's time constant plus motor lag and delays.

    Args:
        signals: Keeps the observer's states.
        vehicle: Mass, inertia, motor lags.
        effectiveness: B, (6, n).
        body: Inertial measurements.
        felt_moment: Moment of the contact, measured [N m], (3,).
        normal: Unit vector into the wall, in B.
        touching: 1 in contact or about to be.
        noise: Deviation of the filtered push in free flight [N].
        adapt_in_contact: False without feed-forward: contact moments would be taken for a load.
    """
    thrusts, ready = lagged_thrusts(signals, vehicle, body.dt)
    rotors = ca.DM(effectiveness) @ thrusts
    awake = ca.logic_and(ready, body.dt > 0.0)
    active = awake if adapt_in_contact else ca.logic_and(awake, ca.logic_not(touching))
    force = _force(signals, vehicle, body, rotors[:3], normal, touching, noise, awake, active)
    moment = _moment(signals, vehicle, body, rotors[3:] + felt_moment, awake, active)
    return ca.vertcat(force, moment)


def _moment(signals: Signals, vehicle: VehicleParams, body: Body, known: ca.SX, awake: ca.SX, active: ca.SX) -> ca.SX:
    old, started = signals.state("external_moment", 3), signals.state("external_started")
    integral = signals.state("external_momentum", 3)
    momentum = ca.DM(vehicle.inertia_kg_m2) * body.rate
    begun = ca.if_else(started, integral, momentum - old / MOMENT_BANDWIDTH)
    moved = begun + body.dt * (known - ca.cross(body.rate, momentum) + old)
    new = clamp(MOMENT_BANDWIDTH * (momentum - moved), -MOMENT_BOUND, MOMENT_BOUND)
    signals.remember("external_momentum", ca.if_else(active, moved, integral))
    signals.remember("external_started", ca.if_else(awake, active, started))
    return signals.remember("external_moment", ca.if_else(active, new, old))


def _force(
    signals: Signals,
    vehicle: VehicleParams,
    body: Body,
    rotors: ca.SX,
    normal: ca.SX,
    touching: ca.SX,
    noise: ca.SX,
    awake: ca.SX,
    active: ca.SX,
) -> ca.SX:
    old, time = signals.state("external_force", 3), signals.state("external_time")
    time = signals.remember("external_time", ca.if_else(awake, time + body.dt, time))
    free = vehicle.mass_kg * body.specific_force - rotors - old
    felt = free - body.wrench[:3]
    size = ca.dot(normal, felt)
    along = size * normal
    pressing = GUST_BANDWIDTH * _windy(signals, body.dt, touching * size) / (1.0 + (noise / QUIET_PUSH) ** 2)
    learnt = _share(pressing, body.dt) * along + _share(FORCE_BANDWIDTH_WALL, body.dt) * (felt - along)
    average = ca.if_else(time < START_TIME, body.dt / ca.fmax(time, 1e-9), 0.0)
    step = ca.if_else(touching, learnt, ca.fmax(_share(FORCE_BANDWIDTH_FREE, body.dt), average) * free)
    new = clamp(old + step, -FORCE_BOUND, FORCE_BOUND)
    return signals.remember("external_force", ca.if_else(ca.logic_and(active, body.specific_force_known), new, old))


def _windy(signals: Signals, dt: ca.SX, unlearnt: ca.SX) -> ca.SX:
    """Weight of the observer along the normal: 0 in calm air to 1 in gusts, by the power of the unlearnt force."""
    smooth, power = signals.state("gust_unlearnt"), signals.state("gust_power")
    smooth = signals.remember("gust_unlearnt", smooth + _share(GUST_BANDWIDTH, dt) * (unlearnt - smooth))
    power = signals.remember("gust_power", power + _share(1.0 / CALM_TIME, dt) * (smooth**2 - power))
    return power / (power + CALM_AIR**2)


def _share(bandwidth: ca.SX | float, dt: ca.SX) -> ca.SX:
    """Share of the difference that a first-order filter takes over in a tick."""
    return 1.0 - ca.exp(-bandwidth * dt)
