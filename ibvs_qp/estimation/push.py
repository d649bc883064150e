"""Push on the wall from the contact wrench: first-order filter, and its noise in free flight."""

from __future__ import annotations

import math

import casadi as ca

from ibvs_qp.config import ContactSettings
from ibvs_qp.symbolic.logic import where
from ibvs_qp.symbolic.signals import Signals

#: Variance of the filtered push before free flight shows it [N^2].
FIRST_PUSH_VARIANCE = 0.02


class PushFilter:
    """Filtered push and contact moment of one tick.

    Attributes:
        push: Filtered push [N].
        push_noise: Its standard deviation in free flight [N].
        moment_noise: Standard deviation of a filtered moment in free flight [N m].

    Args:
        signals: Registry.
        settings: Filter and averaging time.
        wrench: Contact wrench ON the vehicle [N, N m], (6,).
        interval: Time since the last force sample [s]; 0 when there is no new one.
        normal: Unit vector into the wall, in B, (3,).
        free: Whether the vehicle flies away from the wall: a sample is noise.
    """

    def __init__(
        self,
        signals: Signals,
        settings: ContactSettings,
        wrench: ca.SX,
        interval: ca.SX,
        normal: ca.SX,
        free: ca.SX,
    ) -> None:
        push, mean, moment_variance = (signals.state(f"push.{name}") for name in ("value", "mean", "moment_variance"))
        variance = signals.state("push.variance", start=FIRST_PUSH_VARIANCE)
        moment = signals.state("push.moment", 3)
        gain = 1.0 - ca.exp(-2.0 * math.pi * settings.force_filter_hz * interval)
        push = push + gain * (-ca.dot(wrench[:3], normal) - push)
        moment = moment + gain * (wrench[3:] - moment)
        learn = where(free, ca.fmin(1.0, interval / settings.estimation.noise_time_s), 0.0)
        mean = mean + learn * (push - mean)
        variance = variance + learn * ((push - mean) ** 2 - variance)
        # Half the squared length: two of the three moments come from forces across the tip.
        moment_variance = moment_variance + learn * (0.5 * ca.sumsqr(moment) - moment_variance)
        for name, value in {
            "value": push,
            "mean": mean,
            "variance": variance,
            "moment": moment,
            "moment_variance": moment_variance,
        }.items():
            signals.remember(f"push.{name}", value)
        self.push, self.push_noise, self.moment_noise = push, ca.sqrt(variance), ca.sqrt(moment_variance)
