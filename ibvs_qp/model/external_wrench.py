"""Observer of the unmodelled wrench: wrong mass, shifted centre of mass, wind."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.config import ContactSettings, ControllerConfig, VehicleParams
from ibvs_qp.config.contact import LEAST_QUIET
from ibvs_qp.model.inputs import Body, Contact, clamp
from ibvs_qp.model.motor_thrust import MotorThrust
from ibvs_qp.symbolic.signals import Signals

#: Bandwidth of the force observer in free flight, and in contact in the wall's plane in calm air [rad/s]; in gusts it
#: is `contact.plane_bandwidth_rad_s` there, and along the normal `contact.gust_bandwidth_rad_s`. In calm air a faster
#: one mistakes changing friction for an external force: at 4 rad/s the climb to row 4 lasts 1 s longer.
FORCE_BANDWIDTH_FREE, FORCE_BANDWIDTH_WALL = 4.0, 1.5
#: Noise of the filtered push at which the bandwidth along the normal halves [N]: the observer passes it on as force.
QUIET_PUSH = 0.3
#: Band of the changes of the force along the normal that count as a gust [rad/s], and the deviation at which the weight
#: is one half [N]: found in gusts of 2 N rms and in calm air (2 seeds each of the worlds datasheet and harsh).
SLOW_CHANGE, FAST_CHANGE, CALM_CHANGE = 0.5, 4.0, 0.3
#: Noise variance of the sum of two squares of filtered forces, in variances of one [-].
CHANGE_NOISE = 2.0
#: In calm air a fast observer only passes on sensor noise. Its bandwidth halves where the force not yet
#: learnt is this strong [N rms], low-passed at its own bandwidth and averaged over this time [s].
CALM_AIR, CALM_TIME = 0.1, 0.5
#: Power of the unlearnt force up to this many times that of the accelerometer's noise is no gust: a power averaged
#: over half a second scatters by its own size.
NOISE_POWERS = 2.0
#: Bandwidth of the moment observer [rad/s]; below the attitude loop so that the two do not fight.
MOMENT_BANDWIDTH = 2.5
#: The force observer averages evenly over this time at the start, then turns to its bandwidth [s].
START_TIME = 0.25
#: Largest believable external force and moment [N], [N m]; beyond it is a fault, not a load.
FORCE_BOUND, MOMENT_BOUND = 40.0, 6.0


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
) -> ca.SX:
    r"""Momentum and accelerometer observer of the unmodelled wrench at the centre of mass [N, N m], (6,).

    Force: :math:`m f_{spec} - B_F \hat u - F_c`, low-passed, with the lagged thrusts :math:`\hat u` and the measured
    contact force F_c. Moment: first-order momentum observer of
    :math:`J\dot\Omega + \Omega\times J\Omega - B_M \hat u - M_{ff}` (De Luca and Mattone, 2003, without joint axes).
    In contact the measured force is subtracted, which separates a gust along the normal from the wall's reaction:
    with the true thrusts and force there is no loop through the wall. Without feed-forward the observer rests in
    contact, because it would take contact moments for a load. A gust of correlation time T_g and rms s then leaves a
    push error of :math:`s\sqrt{T/(T_g+T)}`, T being the observer's time constant plus motor lag and delays.

    ``felt_moment`` is the measured moment of the contact [N m], (3,), ``touching`` 1 in contact or just before it;
    of ``contact`` the noise of push and accelerometer counts; ``motors`` are the lagged thrusts.
    """
    vehicle = config.vehicle
    rotors = ca.DM(effectiveness) @ motors.thrusts
    awake = ca.logic_and(motors.ready, body.dt > 0.0)
    active = awake if config.contact_feedforward else ca.logic_and(awake, ca.logic_not(touching))
    force = _force(signals, config, body, rotors[:3], normal, touching, contact, awake, active)
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
) -> ca.SX:
    old, time = signals.state("external_force", 3), signals.state("external_time")
    time = signals.remember("external_time", ca.if_else(awake, time + body.dt, time))
    free, bandwidth = config.vehicle.mass_kg * body.specific_force - rotors - old, config.contact.gust_bandwidth_rad_s
    felt = free - body.wrench[:3]
    size = ca.dot(normal, felt)
    along = size * normal
    vibration = config.vehicle.mass_kg * contact.acceleration_noise
    felt_touch = ca.logic_and(touching, ca.logic_and(awake, body.specific_force_known))
    windy = _change_weight(signals, body.dt, size, ca.dot(normal, old), felt_touch, vibration)
    steady = ca.fmax(quiet_rate(contact, config.contact), LEAST_QUIET)
    pressing = bandwidth * windy * steady / (1.0 + (contact.push_noise / QUIET_PUSH) ** 2)
    across, fastest = felt - along, config.contact.plane_bandwidth_rad_s
    windy = _unlearnt_weight(signals, fastest, body.dt, touching * across, vibration)
    plane = FORCE_BANDWIDTH_WALL + (fastest - FORCE_BANDWIDTH_WALL) * windy
    learnt = filter_gain(pressing, body.dt) * along + filter_gain(plane, body.dt) * across
    average = ca.if_else(time < START_TIME, body.dt / ca.fmax(time, 1e-9), 0.0)
    step = ca.if_else(touching, learnt, ca.fmax(filter_gain(FORCE_BANDWIDTH_FREE, body.dt), average) * free)
    new = clamp(old + step, -FORCE_BOUND, FORCE_BOUND)
    return signals.remember("external_force", ca.if_else(ca.logic_and(active, body.specific_force_known), new, old))


def _change_weight(
    signals: Signals, dt: ca.SX, unlearnt: ca.SX, learnt: ca.SX, touching: ca.SX, vibration: ca.SX
) -> ca.SX:
    """Weight of the observer along the normal: 0 in calm air to 1 in gusts, by the power of the force's changes.

    Those of the whole force, learnt and unlearnt, and the unlearnt part: in a gust a fast observer leaves less of it
    than the accelerometer's noise, and a weight by that part alone closes as the bandwidth opens.

    Args:
        signals: Registry.
        dt: Time since the last step [s].
        unlearnt: External force along the normal beyond the learnt one, one sample [N].
        learnt: Force that the observer gives [N].
        touching: 1 in contact or just before it, with an accelerometer and known thrusts; it begins anew there.
        vibration: Deviation of one sample by the accelerometer's noise [N]: no gust.
    """
    force = learnt + unlearnt
    begun, fast, slow = (signals.state(f"gust_{name}") for name in ("begun", "fast", "slow"))
    gain = filter_gain(FAST_CHANGE, dt)
    # Both begin at the learnt force: a single sample holds the vibration.
    fast = signals.remember("gust_fast", ca.if_else(begun, fast + gain * (force - fast), learnt))
    slow = signals.remember("gust_slow", ca.if_else(begun, slow + filter_gain(SLOW_CHANGE, dt) * (fast - slow), learnt))
    signals.remember("gust_begun", touching)
    left = signals.state("gust_unlearnt")
    left = signals.remember("gust_unlearnt", ca.if_else(begun, left + gain * (unlearnt - left), 0.0))
    squared = touching * ((fast - slow) ** 2 + left**2)
    return _windy(signals, "gust", dt, squared, CHANGE_NOISE * vibration**2 * gain / (2.0 - gain), CALM_CHANGE)


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
    return _windy(signals, "plane", dt, ca.sumsqr(smooth) / 2.0, vibration**2 * gain / (2.0 - gain), CALM_AIR)


def _windy(signals: Signals, name: str, dt: ca.SX, squared: ca.SX, noise: ca.SX, calm: float) -> ca.SX:
    """Weight by the mean of a squared force [N^2] beyond noise [N^2]; one half at ``calm`` [N] without noise."""
    power = signals.state(f"{name}_power")
    power = signals.remember(f"{name}_power", power + filter_gain(1.0 / CALM_TIME, dt) * (squared - power))
    gust = ca.fmax(power - NOISE_POWERS * noise, 0.0)
    return gust / (gust + calm**2 + noise)


def quiet_rate(contact: Contact, settings: ContactSettings) -> ca.SX:
    """Weight of K_sd, K_fp and the observer along the normal by the noise of the rate [-], 1/2 at `rate_quiet_m_s`.

    A rate that is mostly noise would be pushed into the wall. The proportional gain and the observer need the damping:
    without K_sd they make the contact oscillate.
    """
    return 1.0 / (1.0 + (contact.rate_noise / settings.rate_quiet_m_s) ** 4)


def filter_gain(bandwidth: ca.SX | float, dt: ca.SX) -> ca.SX:
    """Gain per tick of a first-order filter."""
    return 1.0 - ca.exp(-bandwidth * dt)
