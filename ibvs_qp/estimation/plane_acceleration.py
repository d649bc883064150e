"""Specific force for the motion in the wall plane: of the motors' model in calm air, of the accelerometer in gusts."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca

from ibvs_qp.config import EstimationConfig
from ibvs_qp.estimation.push_disturbance import SLOW_CHANGE, filter_gain, gust_weight
from ibvs_qp.symbolic.logic import both, where
from ibvs_qp.symbolic.signals import Signals

#: Band of the accelerometer's broadband noise [rad/s]: above the gusts, below the lines of the rotors, which integrate
#: to nothing.
NOISE_LOW, NOISE_HIGH = 60.0, 120.0
#: Power of white noise of unit density [1/s] behind two poles at `NOISE_HIGH` and one zero and pole at `NOISE_LOW`.
NOISE_POWER = NOISE_HIGH**3 / (4.0 * (NOISE_HIGH + NOISE_LOW) ** 2)
#: Bandwidth of the rate of the contact force [rad/s], by which a late sample is led.
CONTACT_CHANGE = 30.0
#: Changes of the unexplained acceleration below this bandwidth [rad/s] are gusts.
GUST_HIGH = 8.0
#: A change of this many times the power of noise and calm air is a gust at once: noise alone has it once in 8000 ticks.
JUMP_POWERS = 9.0
#: Power of the changes of an accelerometer without any noise [m^2/s^4].
LEAST_POWER = 1e-12


class PlaneForce(NamedTuple):
    """Specific force of a tick."""

    force: ca.SX  # in B [m/s^2], (3,)
    density: ca.SX  # noise of a component in the wall plane [m^2/s^3]


def plane_force(
    signals: Signals,
    config: EstimationConfig,
    *,
    dt: ca.SX,
    measured: ca.SX,
    motors: ca.SX,
    contact: ca.SX,
    delay_s: float,
    normal: ca.SX,
    use_model: ca.SX,
) -> PlaneForce:
    r"""Specific force by motors' model and accelerometer, and its noise.

    .. math:: \hat f = f_{calm} + w (f - f_{calm}), \quad f_{calm} = f_{motors} + f_{contact} + f_{slow}

    The motors' thrusts, the measured contact and a slow rest explain the acceleration except for gusts. The
    accelerometer measures gusts and vibration: white noise of 1 m/s^2 at 250 Hz makes the tip sway by 4 mm, with the
    model by 3 mm. So w is 0 in calm air and near 1 in gusts. It follows the changes in the wall plane that motors and
    contact do not explain, beyond the accelerometer's broadband noise. That noise is also the noise of the result: in
    calm air the model has about the same error.

    Args:
        signals: Registry of the filters' states.
        config: Averaging time of the noise, and the changes at which w is one half.
        dt: Time since the last tick [s].
        measured: Accelerometer f [m/s^2], (3,).
        motors: Specific force by the motors' model at the last tick [m/s^2], (3,); zero before the first command.
        contact: Specific force by the measured contact [m/s^2], (3,).
        delay_s: Age of that sample [s]. It is led by its rate to the time of the motors' force, a tick ago: while a
            stuck tip is drawn, friction rises with the thrust, and a later sample of it is a false acceleration.
        normal: Unit vector into the wall, in B, (3,).
        use_model: Whether the tip presses, and the camera corrects the velocity. Otherwise the accelerometer alone
            counts: without planes the velocity drifts by the difference of its bias to that of the model.
    """
    known = ca.sumsqr(motors) > 0.0
    late = signals.state("plane.contact", 3)
    late = signals.remember("plane.contact", late + filter_gain(CONTACT_CHANGE, dt) * (contact - late))
    explained = motors + contact + ca.fmax(delay_s - dt, 0.0) * CONTACT_CHANGE * (contact - late)
    across = ca.SX.eye(3) - normal @ normal.T
    rest = where(known, across @ (measured - explained), 0.0)
    density = _noise_density(signals, across @ measured, dt, config.vibration_time_s)

    fast, slow = signals.state("plane.fast", 3), signals.state("plane.slow", 3)
    fast = signals.remember("plane.fast", fast + filter_gain(GUST_HIGH, dt) * (rest - fast))
    time = signals.remember("plane.time", signals.state("plane.time") + where(known, dt, 0.0))
    # At first the mean: the bias of the motion filter is that of this force, and the accelerometer takes over.
    gain = ca.fmax(filter_gain(SLOW_CHANGE, dt), dt / ca.fmax(time, dt))
    slow = signals.remember("plane.slow", slow + gain * (rest - slow))
    changed = ca.sumsqr(fast - slow) / 2.0
    gust: ca.SX | float = 1.0
    if config.calm_change:
        noise = density * GUST_HIGH / 2.0 + LEAST_POWER
        gust = gust_weight(signals, "plane.change", dt, changed, noise, config.calm_change)
        least = config.calm_change**2 + noise
        jump = ca.fmax(changed - JUMP_POWERS * least, 0.0)
        gust = ca.fmax(gust, jump / (jump + least))
    calm = explained + slow
    return PlaneForce(where(both(known, use_model), calm + gust * (measured - calm), measured), density)


def _noise_density(signals: Signals, across: ca.SX, dt: ca.SX, time_s: float) -> ca.SX:
    """Density of a component's broadband noise [m^2/s^3], of the accelerometer in the wall plane [m/s^2], (3,)."""
    begun = signals.state("plane.begun")
    signals.remember("plane.begun", ca.SX(1.0))

    def low_passed(name: str, value: ca.SX, bandwidth: float) -> ca.SX:
        before = signals.state(f"plane.{name}", 3)
        moved = before + filter_gain(bandwidth, dt) * (value - before)
        return signals.remember(f"plane.{name}", where(begun, moved, across))

    twice = low_passed("noise_twice", low_passed("noise_once", across, NOISE_HIGH), NOISE_HIGH)
    shaken = ca.sumsqr(twice - low_passed("noise_slow", twice, NOISE_LOW)) / 2.0
    power = signals.state("plane.noise_power")
    return signals.remember("plane.noise_power", power + filter_gain(1.0 / time_s, dt) * (shaken - power)) / NOISE_POWER
