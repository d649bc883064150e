"""Attitude without steps that the gyro did not measure; roll and pitch; angular velocity by gyro and motors."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.inputs import Body, MotorThrust
from ibvs_qp.quaternion import multiply
from ibvs_qp.symbolic.logic import both, clamp, either, no, where
from ibvs_qp.symbolic.signals import Signals

#: Least difference between an attitude and the one predicted by the gyro that is a step [rad], and least one in root
#: mean squares of that difference [-]: noise that counts as steps makes the attitude a random walk, 20 deg in 30 s at
#: 0.3 deg a sample.
STEP, STEP_SIGMAS = math.radians(1.0), 6.0
#: Averaging time of that mean square at 100 Hz and more [s], time for which one sample counts at most, late as it may
#: be [s], and its largest root [rad]: 0.3 deg a sample and axis, or a spell of steps.
NOISE_TIME, LONGEST_SAMPLE, MOST_NOISE = 1.0, 0.01, math.radians(0.8)
#: Rate at which an absorbed step is given back [rad/s]: half a degree per second, slow against the filters that learn
#: the direction of gravity.
RETURN_RATE = math.radians(0.5)
#: Time constant of the gyro's bias [s]: attitude noise of 0.05 deg a sample passes as 0.05 deg/s, a tenth of the
#: noise of a MEMS gyro. Largest bias [rad/s]: ten times that of a MEMS gyro without calibration.
BIAS_TIME, MOST_BIAS = 1.0, math.radians(10.0)
#: Standard deviations of the attitude's noise that count, and time after which an attitude that stays the same is
#: compared [s]: slower ones are no input of this estimate.
NOISE_SIGMAS, LONGEST_COMPARED = 2.0, 0.1
#: Bias that is not subtracted [rad/s]: three standard deviations of this estimate in the world datasheet, so that a
#: sound gyro stays as it is; 5 mm/s at the tip.
UNCERTAIN_BIAS = math.radians(0.4)
#: From this bandwidth on the attitude estimate counts as it is [Hz].
UNFILTERED_HZ = 1000.0


def continuous_attitude(signals: Signals, measured: ca.SX, last: ca.SX, rate: ca.SX, dt: ca.SX) -> ca.SX:
    """Attitude (w, x, y, z) without steps that the gyro did not measure: absorbed at once, given back slowly.

    An estimator that re-aligns itself moves its attitude by degrees in one tick. Taken at once, gravity leaks into
    the accelerations along the wall and the wall normal, 0.34 m/s^2 for 2 degrees, faster than any filter learns it.

    Args:
        signals: Registry.
        measured: Attitude, (4,).
        last: Attitude given out in the last tick, measured or not, (4,).
        rate: Angular velocity in B [rad/s], (3,).
        dt: Time since the last tick [s].
    """
    begun, power = signals.state("steps.begun"), signals.state("steps.power")
    # Rotation from the attitude given out to the measured one; without one the measured attitude stays as it is.
    offset, absorbed = signals.state("steps.offset", 4, (1.0, 0.0, 0.0, 0.0)), signals.state("steps.absorbed")
    last = where(begun, last, measured)
    predicted = _product(last, ca.vertcat(1.0, 0.5 * dt * rate))

    sine = ca.norm_2(offset[1:])
    left = 2.0 * ca.atan2(sine, ca.fabs(offset[0])) - RETURN_RATE * dt
    absorbed = both(absorbed, left > 0.0)
    scale = ca.sin(0.5 * left) / where(absorbed, sine, 1.0)
    shorter = ca.vertcat(ca.cos(0.5 * left), where(offset[0] < 0.0, -scale, scale) * offset[1:])
    offset = where(absorbed, shorter, ca.DM([1.0, 0.0, 0.0, 0.0]))

    given = where(absorbed, _product(measured, offset), measured)
    step, gate = _angle(predicted, given), ca.fmax(STEP, STEP_SIGMAS * ca.sqrt(power))
    square = ca.fmin(ca.fmin(step, gate), MOST_NOISE) ** 2
    signals.remember("steps.power", power + ca.fmin(dt, LONGEST_SAMPLE) / NOISE_TIME * (square - power))
    steps = step > gate
    given = where(steps, predicted / ca.norm_2(predicted), given)
    new_offset = _product(_inverse(measured), predicted)
    signals.remember("steps.offset", where(steps, new_offset / ca.norm_2(new_offset), offset))
    signals.remember("steps.absorbed", either(steps, absorbed))
    signals.remember("steps.begun", ca.SX(1.0))
    return given


def gyro_bias(signals: Signals, measured: ca.SX, attitude: ca.SX, rate: ca.SX, dt: ca.SX, elapsed: ca.SX) -> ca.SX:
    r"""Certain part of the gyro's bias [rad/s], (3,): the slow difference from the rate of the measured attitude.

    .. math:: \dot b = (\Omega_{gyro} - \Omega_{attitude} - b) / T

    The lever of the tip, 0.7 m, makes a bias of 1 deg/s a drift of the odometer of 12 mm/s. The gyro is integrated
    until the attitude changes. A difference counts as far as noise and the largest bias explain it: an attitude that
    re-aligns itself is no rotation.

    Args:
        signals: Registry; `continuous_attitude` has the noise of the attitude there.
        measured: Whether attitude and gyro are measured; after a gap, and after missing ticks, the comparison begins
            anew and the bias stays.
        attitude: As measured, (w, x, y, z), (4,).
        rate: Angular velocity as measured [rad/s], (3,).
        dt: Time since the last tick, bounded [s].
        elapsed: The same, not bounded [s].
    """
    bias, begun = signals.state("gyro.bias", 3), signals.state("gyro.begun")
    signals.state("gyro.excess", 3)
    last = signals.state("gyro.attitude", 4, (1.0, 0.0, 0.0, 0.0))
    whole = both(begun, measured, elapsed <= dt)
    turned, time = signals.state("gyro.turned", 3) + dt * rate, signals.state("gyro.time") + dt
    change = _product(_inverse(last), attitude)
    turn = 2.0 * where(change[0] < 0.0, -1.0, 1.0) * change[1:]
    due = both(whole, either(ca.norm_2(attitude - last) > 0.0, time >= LONGEST_COMPARED))
    most = MOST_BIAS * time + NOISE_SIGMAS * ca.sqrt(signals.state("steps.power"))
    difference = clamp(turned - turn, -most, most)
    new = clamp(bias + (difference - time * bias) / BIAS_TIME, -MOST_BIAS, MOST_BIAS)
    anew = either(due, no(whole))
    signals.remember("gyro.begun", measured)
    signals.remember("gyro.attitude", where(anew, attitude, last))
    signals.remember("gyro.turned", where(anew, ca.DM.zeros(3), turned))
    signals.remember("gyro.time", where(anew, 0.0, time))
    found = signals.remember("gyro.bias", where(due, new, bias))
    return signals.remember("gyro.excess", found - clamp(found, -UNCERTAIN_BIAS, UNCERTAIN_BIAS))


def filtered_roll_pitch(signals: Signals, angles: ca.SX, rates: ca.SX, bandwidth_hz: float, dt: ca.SX) -> ca.SX:
    r"""Roll and pitch [rad], (2,), by a complementary filter: angular velocity above a frequency, attitude below.

    .. math:: \dot{\hat\varphi} = \dot\varphi + 2\pi f (\varphi - \hat\varphi)

    An attitude estimate has noise of 0.07 deg a sample in the datasheet world; a stiff level row passes it on to the
    rotors.

    Args:
        signals: Registry of the filter's state.
        angles: Roll and pitch of the attitude estimate [rad], (2,).
        rates: Their rates [rad/s], (2,).
        bandwidth_hz: f [Hz].
        dt: Time since the last step [s].
    """
    if bandwidth_hz >= UNFILTERED_HZ:
        return angles
    before, begun = signals.state("roll_pitch", 2), signals.state("roll_pitch_begun")
    predicted = before + dt * rates
    gain = 1.0 - ca.exp(-2.0 * math.pi * bandwidth_hz * dt)
    signals.remember("roll_pitch_begun", ca.SX(1.0))
    return signals.remember("roll_pitch", ca.if_else(begun, predicted + gain * (angles - predicted), angles))


def estimated_rate(
    signals: Signals, config: ControllerConfig, effectiveness: np.ndarray, body: Body, motors: MotorThrust
) -> tuple[ca.SX, ca.SX]:
    r"""Angular velocity [rad/s] and acceleration [rad/s^2] in B, (3,) each.

    .. math:: \hat\alpha = J^{-1}(B_M \hat u + M_{ext} - \Omega\times J\Omega), \qquad
              \dot{\hat\Omega} = \hat\alpha + 2\pi f (\Omega - \hat\Omega)

    with the gyro Omega, the lagged thrusts :math:`\hat u`, the moments observed and fed forward at the step before, and
    f = ``angular_rate.gyro_bandwidth_hz``. Above f the motors' model counts: the rotors do not follow the gyro's noise,
    and a commanded rotation is not late, as it is behind a low-pass filter.
    """
    inertia = ca.sparsify(config.vehicle.inertia)
    outside = signals.state("external_moment", 3)
    if config.contact_feedforward:
        outside += signals.state("feedforward_moment", 3)
    moment = ca.DM(effectiveness[3:]) @ motors.thrusts + outside - ca.cross(body.gyro, inertia @ body.gyro)
    awake = ca.logic_and(motors.ready, body.dt > 0.0)
    acceleration = ca.if_else(awake, ca.solve(inertia, moment), 0.0)
    gain = 1.0 - ca.exp(-2.0 * math.pi * config.angular_rate.gyro_bandwidth_hz * body.dt)
    predicted = signals.state("angular_rate", 3) + body.dt * acceleration
    rate = ca.if_else(awake, predicted + gain * (body.gyro - predicted), body.gyro)
    return signals.remember("angular_rate", rate), acceleration


def _angle(first: ca.SX, second: ca.SX) -> ca.SX:
    """Angle between two attitudes [rad]; a quaternion and its negative are one."""
    between = _product(_inverse(first), second)
    return 2.0 * ca.atan2(ca.norm_2(between[1:]), ca.fabs(between[0]))


def _product(first: ca.SX, second: ca.SX) -> ca.SX:
    return ca.vertcat(*multiply(ca.vertsplit(first), ca.vertsplit(second)))


def _inverse(quaternion: ca.SX) -> ca.SX:
    return ca.vertcat(quaternion[0], -quaternion[1:])
