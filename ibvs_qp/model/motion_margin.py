r"""Robustness of one axis of a rotation, of one line, or of the distance, in free flight: the peak of its sensitivity.

A double integrator behind the motors' lag and the sampling, :math:`P(s) = e^{-s T_h} / (s^2 (\tau s + 1))`, under

.. math::
    a = F(s) [-(K_p + K_i / s)\, x - K_d (\hat v + T \hat a)], \qquad
    \hat a = \frac{a}{\tau s + 1}, \qquad \hat v = \frac{\omega_g s\, x + \hat a}{s + \omega_g},

the rate estimate of `ibvs_qp.estimation.attitude` with the gyro's bandwidth omega_g, the lead T and the filter of the
row, :math:`F(s) = (1 - k_u) / (1 - k_u e^{-s \Delta t})` with :math:`k_u = e^{-\Delta t / T_u}`. Broken at the command,

.. math::
    L(s) = P(s) F(s) \frac{K_p + K_i/s + K_d\, \omega_g s / (s + \omega_g)}
                     {1 + F(s) K_d (T + 1/(s + \omega_g)) / (\tau s + 1)}, \qquad
    M_s = \max_\omega |1 + L(j\omega)|^{-1}.

The loop tolerates any factor on its gain up to M_s / (M_s - 1), and a phase of 2 arcsin(1 / (2 M_s)). T_h is the time
from a sample to the middle of the hold of its command.

The formula is finite for an unstable loop, too. The same loop in discrete time, with a command that acts one tick after
its sample, has its poles inside the unit circle if it is stable.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.controller import ControllerConfig

#: Gains with a larger sensitivity peak are not searched: 2.0 tolerates twice the gain and 29 degrees of phase. The same
#: with motors of another lag than the configured one, and the ratios of that lag: 2.3 tolerates 1.8 times the gain.
LARGEST_SENSITIVITY, LARGEST_WITH_OTHER_LAG, LAG_RATIOS = 2.0, 2.3, (0.75, 1.3)
#: Ticks from a sample to the middle of its command's hold: half a tick, and a tick that a sample may be old.
TICKS_LATE = 1.5
#: Frequencies at which the sensitivity is evaluated [rad/s]; crossover is at 5 to 20 rad/s.
FREQUENCIES = np.geomspace(0.3, 300.0, 600)


@dataclass(frozen=True, kw_only=True)
class MotionLoop:
    """Feedback of one axis.

    Attributes:
        kp, kd, ki: Gains of position [1/s^2], rate [1/s] and integral [1/s^3].
        lag: Mean lag of the motors [s].
        delay: From a sample to the middle of its command's hold [s].
        lead: The rate is predicted this far ahead [s].
        bandwidth_hz: Of the measured rate in its estimate [Hz]; infinite without a model of the motors.
        filter_s: Time constant of the row's filter, T_u [s]; tick_s: time between commands [s].
        lag_ratio: Lag of the real motors over the modelled one [-].
    """

    kp: float
    kd: float
    lag: float
    delay: float
    ki: float = 0.0
    lead: float = 0.0
    bandwidth_hz: float = math.inf
    filter_s: float = 0.0
    tick_s: float = 0.004
    lag_ratio: float = 1.0

    def sensitivity(self, frequencies: np.ndarray) -> np.ndarray:
        """1 / (1 + L) at frequencies [rad/s]; same shape."""
        s, lagged = 1j * frequencies, 1j * frequencies * self.lag + 1.0
        if math.isinf(self.bandwidth_hz):
            measured, modelled = self.kd * s, self.kd * self.lead / lagged
        else:
            corner = 2.0 * math.pi * self.bandwidth_hz
            measured = self.kd * corner * s / (s + corner)
            modelled = self.kd * (self.lead + 1.0 / (s + corner)) / lagged
        kept = math.exp(-self.tick_s / self.filter_s) if self.filter_s else 0.0
        filtered = (1.0 - kept) / (1.0 - kept * np.exp(-self.tick_s * s))
        plant = filtered * np.exp(-self.delay * s) / (s**2 * (self.lag_ratio * self.lag * s + 1.0))
        return 1.0 / (1.0 + plant * (self.kp + self.ki / s + measured) / (1.0 + filtered * modelled))

    @property
    def sensitivity_peak(self) -> float:
        """M_s: largest amplification of a disturbance; 1 / M_s is the distance of L from -1. Infinite if unstable."""
        if self.spectral_radius >= 1.0:
            return math.inf
        return float(np.abs(self.sensitivity(FREQUENCIES)).max())

    @property
    def spectral_radius(self) -> float:
        """Largest magnitude of a pole per tick; the loop is stable below 1."""
        from scipy.linalg import expm  # heavy, and no flight needs it

        dt, slow = self.tick_s, self.lag_ratio * self.lag
        rates = np.zeros((4, 4))  # of position, rate, acceleration and the command that acts
        rates[0, 1] = rates[1, 2] = 1.0
        rates[2, 2:] = -1.0 / slow, 1.0 / slow
        plant = expm(rates * dt)[:3]
        modelled = 1.0 - math.exp(-dt / self.lag)
        fresh = 1.0 if math.isinf(self.bandwidth_hz) else 1.0 - math.exp(-2.0 * math.pi * self.bandwidth_hz * dt)
        kept = math.exp(-dt / self.filter_s) if self.filter_s else 0.0
        # States: position, rate, acceleration, last command, modelled acceleration, estimated rate, integral.
        rate = np.array([0.0, fresh, 0.0, 0.0, (1.0 - fresh) * dt, 1.0 - fresh, 0.0])
        feedback = -self.kd * (rate + self.lead * np.eye(7)[4])
        feedback[[0, 6]] -= self.kp, self.ki
        command = (1.0 - kept) * feedback + kept * np.eye(7)[3]
        step = np.zeros((7, 7))
        step[:3, :4] = plant
        step[3], step[5] = command, rate
        step[4] = modelled * command + (1.0 - modelled) * np.eye(7)[4]
        step[6, [0, 6]] = dt, 1.0
        states = 7 if self.ki else 6  # without its gain the integral is no part of the loop
        return float(np.abs(np.linalg.eigvals(step[:states, :states])).max())


def motion_sensitivity(config: ControllerConfig, lag_ratio: float = 1.0) -> dict[str, float]:
    """Sensitivity peaks of "attitude", "yaw", "line", "standoff" and "landing"; see `MotionLoop`.

    The rates of lines and distance come from the accelerometer and the camera; their leads from the motors' model. The
    last centimetre of an approach, "landing", has a damping of its own. Its speed follows the distance here; at the
    constant speed of a touch the search for the wall has a fifth of that stiffness. The analytic law has no filter of
    the stand-off, so its margin is larger.

    Args:
        config: Gains, leads, filters, tick and motors.
        lag_ratio: Lag of the real motors over the configured one [-].
    """
    gains, rate, vehicle = config.gains, config.angular_rate, config.vehicle
    gyro, approach, landing = rate.gyro_bandwidth_hz, gains.standoff_kd, config.contact.landing_kd
    along, no_motor_model = (gains.push_lead_s, gains.push_filter_s), math.inf
    loops = {
        "attitude": (gains.attitude_kp, gains.attitude_kd, 0.0, rate.lead_s, gains.attitude_filter_s, gyro),
        "yaw": (gains.yaw_kp, gains.yaw_kd, 0.0, rate.lead_s, gains.yaw_filter_s, gyro),
        "line": (gains.line_kp, gains.line_kd, gains.line_ki, gains.line_lead_s, gains.line_filter_s, no_motor_model),
        "standoff": (approach * gains.standoff_kp, approach, 0.0, *along, no_motor_model),
        "landing": (landing * gains.standoff_kp, landing, 0.0, *along, no_motor_model),
    }
    tick, names = config.tick_s, ("kp", "kd", "ki", "lead", "filter_s", "bandwidth_hz")
    shared = {"lag": vehicle.motor_lag_s, "delay": TICKS_LATE * tick, "tick_s": tick, "lag_ratio": lag_ratio}
    return {
        loop: MotionLoop(**shared, **dict(zip(names, own, strict=True))).sensitivity_peak for loop, own in loops.items()
    }
