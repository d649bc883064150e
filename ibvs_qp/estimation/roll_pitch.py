"""Roll and pitch by a complementary filter: the angular velocity above a frequency, the attitude estimate below."""

from __future__ import annotations

import math

import casadi as ca

from ibvs_qp.symbolic.signals import Signals

#: From this bandwidth on the attitude estimate counts as it is [Hz].
UNFILTERED_HZ = 1000.0


def filtered_roll_pitch(signals: Signals, angles: ca.SX, rates: ca.SX, bandwidth_hz: float, dt: ca.SX) -> ca.SX:
    r"""Roll and pitch [rad], (2,).

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
