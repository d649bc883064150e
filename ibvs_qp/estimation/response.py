"""Response of the vehicle against that of the model: signals of the monitors of rotors and push."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.inputs import Body, Contact, MotorThrust
from ibvs_qp.estimation.push_disturbance import filter_gain
from ibvs_qp.symbolic.signals import Signals

#: Bandwidth of the residual wrench [rad/s]: it has half of a step after 23 ms.
RESIDUAL_BANDWIDTH = 30.0
#: One sample of the moment stands for this many ticks at most [-]: after a hole of 0.9 s, 1 N m of it counted as 27.
MOST_TICKS = 10.0
#: Bandwidth of the push by inertial data [rad/s]: of a vibration of 1 m/s^2 at 250 Hz, 1 N rms remains.
PUSH_BANDWIDTH = 10.0
#: Bandwidth of the force learnt away from the wall: wind, wrong thrusts, accelerometer bias [rad/s].
FREE_BANDWIDTH = 1.0
#: The spread of the wind is an average over this time, of forces that change faster than over this time [s].
WIND_TIME, STEADY_TIME = 5.0, 10.0
#: The rotors' errors are learnt at this bandwidth [rad/s], evenly in the first seconds, and only while no rotor misses
#: more than this [N].
LEARNING_BANDWIDTH, FIRST_SECONDS, LEARNT_UP_TO = 0.3, 1.0, 3.0
#: The tip is away from the wall beyond this many times `contact.contact_distance_m`.
AWAY = 3.0


def inertial_push(
    signals: Signals,
    config: ControllerConfig,
    effectiveness: np.ndarray,
    body: Body,
    contact: Contact,
    motors: MotorThrust,
) -> ca.SX:
    r"""Push on the wall without the force sensor [N].

    .. math:: f = n \cdot (B_F \hat u - m f_{spec}),

    low-passed, minus its mean while the tip is away from the wall. A change of the wind since then is part of it: the
    output "wind_spread" is the standard deviation of the same figure along the wall, where the contact is measured [N].
    """
    outside = config.vehicle.mass_kg * body.specific_force - ca.DM(effectiveness[:3]) @ motors.thrusts
    old, mean = signals.state("inertial_push"), signals.state("inertial_push_free")
    ready = ca.logic_and(motors.ready, body.specific_force_known)
    signals.output("wind_spread", _wind_spread(signals, outside - body.wrench[:3], contact.normal, ready, body.dt))
    away = ca.logic_and(ca.logic_not(contact.touching), contact.distance > AWAY * config.contact.contact_distance_m)
    new = ca.if_else(ready, old + filter_gain(PUSH_BANDWIDTH, body.dt) * (-ca.dot(contact.normal, outside) - old), old)
    learnt = ca.if_else(ca.logic_and(ready, away), mean + filter_gain(FREE_BANDWIDTH, body.dt) * (new - mean), mean)
    signals.remember("inertial_push_free", learnt)
    return signals.output("inertial_push", signals.remember("inertial_push", new) - learnt)


def _wind_spread(signals: Signals, force: ca.SX, normal: ca.SX, ready: ca.SX, dt: ca.SX) -> ca.SX:
    """Standard deviation of an unexplained force along the wall, per direction [N]."""
    smooth, steady, power = signals.state("wind", 3), signals.state("wind_steady", 3), signals.state("wind_power")
    along = force - normal * ca.dot(normal, force)

    def followed(name: str, old: ca.SX, target: ca.SX, time: float) -> ca.SX:
        return signals.remember(name, ca.if_else(ready, old + filter_gain(1.0 / time, dt) * (target - old), old))

    smooth = followed("wind", smooth, along, 1.0 / PUSH_BANDWIDTH)
    steady = followed("wind_steady", steady, smooth, STEADY_TIME)
    return ca.sqrt(followed("wind_power", power, 0.5 * ca.sumsqr(smooth - steady), WIND_TIME))


def carried_weight(
    signals: Signals, config: ControllerConfig, effectiveness: np.ndarray, body: Body, motors: MotorThrust
) -> ca.SX:
    """Weight that something else than the rotors carries, low-passed [N]: that of a vehicle on the ground."""
    outside = config.vehicle.mass_kg * body.specific_force - ca.DM(effectiveness[:3]) @ motors.thrusts
    old, ready = signals.state("carried_weight"), ca.logic_and(motors.ready, body.specific_force_known)
    new = ca.if_else(ready, old + filter_gain(PUSH_BANDWIDTH, body.dt) * (-ca.dot(body.down, outside) - old), old)
    return signals.output("carried_weight", signals.remember("carried_weight", new))


def missing_thrust(
    signals: Signals,
    config: ControllerConfig,
    effectiveness: np.ndarray,
    body: Body,
    felt_moment: ca.SX,
    motors: MotorThrust,
) -> ca.SX:
    r"""Thrust that every rotor gives less than commanded, behind the motors' lag [N], (n,).

    The wrench that neither the motors' model nor the measured contact explains,

    .. math:: r = M (f_{spec}, \dot\Omega) + \Omega \times J \Omega - B \hat u - F_c,

    first-order low-passed (the moment by its momentum, without differentiating the gyro), in thrusts: :math:`-B^+ r`.
    Errors that last for seconds, such as mass, thrust coefficients and wind, are subtracted. The output "missing_noise"
    is the standard deviation of one entry while the rotors follow, "motor_thrusts" are the lagged thrusts behind the
    same low-pass filter: minus the missing thrust they are the actual thrusts.

    Args:
        signals: Registry.
        config: The controller's.
        effectiveness: B, (6, n).
        body: Gyro, accelerometer and contact wrench.
        felt_moment: Moment of the contact [N m], (3,).
        motors: Lagged thrusts.
    """
    vehicle, matrix = config.vehicle, ca.DM(effectiveness)
    rotors = matrix @ motors.thrusts
    gain = filter_gain(RESIDUAL_BANDWIDTH, body.dt)
    old_force, old_moment = signals.state("residual_force", 3), signals.state("residual_moment", 3)
    force = vehicle.mass_kg * body.specific_force - rotors[:3] - body.wrench[:3]
    momentum = ca.sparsify(vehicle.inertia) @ body.gyro
    known = rotors[3:] + felt_moment - ca.cross(body.gyro, momentum)
    path, started = signals.state("residual_momentum", 3), signals.state("residual_started")
    in_time = ca.logic_and(body.dt > 0.0, body.dt < MOST_TICKS * config.tick_s)
    ready = ca.logic_and(ca.logic_and(motors.ready, in_time), body.specific_force_known)
    begun = ca.if_else(started, path, momentum - old_moment / RESIDUAL_BANDWIDTH)
    moved = begun + body.dt * (known + old_moment)
    moment = ca.if_else(ready, RESIDUAL_BANDWIDTH * (momentum - moved), old_moment)
    signals.remember("residual_momentum", ca.if_else(ready, moved, path))
    signals.remember("residual_started", ready)
    force = signals.remember("residual_force", ca.if_else(ready, old_force + gain * (force - old_force), old_force))
    smooth = signals.state("motor_thrust_smooth", effectiveness.shape[1])
    smooth = signals.remember("motor_thrust_smooth", smooth + gain * (motors.thrusts - smooth))
    signals.output("motor_thrusts", smooth)
    residual = ca.vertcat(force, signals.remember("residual_moment", moment))
    missing = -ca.DM(np.linalg.pinv(effectiveness)) @ residual
    mean, time = signals.state("missing_mean", effectiveness.shape[1]), signals.state("missing_time")
    time = signals.remember("missing_time", ca.if_else(ready, time + body.dt, time))
    average = ca.if_else(time < FIRST_SECONDS, body.dt / ca.fmax(time, 1e-9), 0.0)
    healthy = ca.logic_and(ready, ca.mmax(ca.fabs(missing - mean)) < LEARNT_UP_TO)
    step = ca.fmax(filter_gain(LEARNING_BANDWIDTH, body.dt), average) * (missing - mean)
    mean = signals.remember("missing_mean", ca.if_else(healthy, mean + step, mean))
    power, spread = signals.state("missing_power"), ca.sumsqr(missing - mean) / effectiveness.shape[1]
    gain = ca.fmax(filter_gain(LEARNING_BANDWIDTH, body.dt), average)
    power = signals.remember("missing_power", ca.if_else(healthy, power + gain * (spread - power), power))
    signals.output("missing_noise", ca.sqrt(power))
    return signals.output("missing_thrust", missing - mean)
