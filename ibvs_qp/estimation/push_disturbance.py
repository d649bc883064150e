"""Kalman filter of push, its rate and the disturbing forces along the wall normal, while the tip touches."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca

from ibvs_qp.config import ControllerConfig
from ibvs_qp.symbolic.logic import both, either, no, where
from ibvs_qp.symbolic.signals import Signals

#: Standard deviations at a touch: push [N], rate [m/s], both forces [N].
PUSH_STD, RATE_STD, FORCE_STD = 0.5, 0.02, 0.3
#: An innovation counts up to this many standard deviations [-]: a force sample may be a spike.
MOST_SIGMAS = 5.0
#: After a hole of this time, and of so many ticks, the filter begins anew [s], [-]: a contact of 10 kN/m swings a
#: twelfth of its period within it.
HOLE_S, HOLE_TICKS = 0.012, 1.5
#: Largest plausible disturbing force [N], acceleration by bias and a wrong attitude [m/s^2], which is that of six
#: degrees, and rate of the penetration [m/s].
FORCE_BOUND, SLOW_BOUND, RATE_BOUND = 40.0, 1.0, 0.5
#: Time for which a stiffness that was not measured errs in the same direction [s].
UNKNOWN_S = 0.05
#: Variance of a measurement that does not exist [N^2].
NO_SAMPLE = 1e12

#: Band of the changes of the force along the normal that count as a gust [rad/s], and the deviation at which the weight
#: is one half [N]: found in gusts of 2 N rms and in calm air (2 seeds each of the worlds datasheet and harsh).
SLOW_CHANGE, FAST_CHANGE, CALM_CHANGE = 0.5, 4.0, 0.3
#: Noise variance of the sum of two squares of filtered forces, in variances of one [-].
CHANGE_NOISE = 2.0
#: The power of a force is averaged over this time [s].
CALM_TIME = 0.5
#: Power up to this many times that of the accelerometer's noise is no gust: a power averaged over half a second
#: scatters by its own size.
NOISE_POWERS = 2.0


class Normal(NamedTuple):
    """Measurements and models along the wall normal of one tick, positive into the wall."""

    dt: ca.SX  # time since the last tick [s]
    touching: ca.SX  # whether the tip touches and the thrusts are known
    felt: ca.SX  # whether there is an accelerometer
    thrust: ca.SX  # force of the lagged thrusts [N]
    weight: ca.SX  # component of the weight [N]
    inertial: ca.SX  # mass times accelerometer [N]
    push: ca.SX  # sample of the force sensor [N]
    push_density: ca.SX  # its noise [N^2/Hz]
    vibration: ca.SX  # standard deviation of a sample of `inertial` [N], not zero
    stiffness: ca.SX  # of brush and wall [N/m]
    stiffness_known: ca.SX  # whether it was measured
    rate: ca.SX  # speed into the wall by the distance filter [m/s]
    rate_std: ca.SX  # its standard deviation [m/s]
    external: ca.SX  # force by the observer of free flight [N]
    bias: ca.SX  # measured minus true acceleration [m/s^2]


class PushDisturbance:
    r"""Push f = p + b v, rate v of the penetration, and the forces d and e along the normal.

    .. math::
        \dot p = k v, \quad m \dot v = F_u + m g_n + d + e - f, \quad \dot d = w_d, \quad \dot e = w_e

    The force sensor measures f a delay ago; accelerometer minus thrusts measures d - f. So d contains wind
    and wrong thrusts, which the accelerometer also measures; e contains its bias, and weight through a wrong attitude.
    The noise of d follows the gusts, so that calm air is filtered more; k is the estimated stiffness. Until it is
    measured, p has the noise of k v and the force sample counts as of now: with 10 kN/m assumed on a brush of 1.5 kN/m
    the filter otherwise explains the push by a disturbing force, and in vibration the vehicle bounces. While the tip is
    free, push is as measured, and rate and forces are those of the free flight's filters.

    Attributes:
        push: f [N].
        rate: v [m/s].
        acceleration: Its derivative by the model [m/s^2].
        gust: d [N].
        slow: e [N].
        external: Force that the observer of free flight would give, d + e + m times bias [N].

    Args:
        signals: Registry.
        config: Mass and brush.
        along: Measurements of the tick.
    """

    def __init__(self, signals: Signals, config: ControllerConfig, along: Normal) -> None:
        mass, damping, delay = config.vehicle.mass_kg, config.brush.damping_n_s_m, config.brush.force_delay_s
        # Without an accelerometer the rate comes from the model of the spring alone.
        trusted = either(along.stiffness_known, no(along.felt))
        late = where(trusted, delay * along.stiffness, 0.0)
        past = ca.vertcat(1.0, damping - late, 0.0, 0.0)
        elastic = along.push - damping * along.rate
        start = ca.vertcat(elastic, along.rate, along.external, -mass * along.bias)
        begun = both(signals.state("push_kalman.begun"), along.dt < max(HOLE_S, HOLE_TICKS * config.tick_s))
        old, stored = signals.state("push_kalman.state", 4), signals.state("push_kalman.covariance", 10)
        spread = ca.vertcat(PUSH_STD**2, RATE_STD**2 + along.rate_std**2, FORCE_STD**2, FORCE_STD**2)
        state = where(begun, old, start)
        lower = ca.SX(ca.Sparsity.lower(4), stored)
        covariance = where(begun, ca.tril2symm(lower), ca.diag(spread))

        sample = along.inertial - along.thrust
        windy = self._gust_weight(signals, along, sample + along.push, state[2])
        step, reaction = along.dt / mass, damping / mass
        spring = along.stiffness * along.dt
        transition = ca.SX.eye(4)
        transition[1, :] = ca.horzcat(-step, 1.0 - along.dt * reaction, step, step)
        transition[0, :] += spring * transition[1, :]  # of the new rate: stable for stiff walls
        given = step * (along.thrust + along.weight)
        state = transition @ state + ca.vertcat(spring * given, given, 0.0, 0.0)
        noise = ca.vertcat(*config.contact.estimation.push_noise(mass, windy))
        unknown = along.stiffness**2 * (state[1] ** 2 + covariance[1, 1]) * UNKNOWN_S
        noise[0] += where(trusted, 0.0, unknown)
        covariance = transition @ covariance @ transition.T + along.dt * ca.diag(noise)

        tick = ca.fmax(along.dt, 0.5 * config.tick_s)  # a held sample counts by its density, once a tick
        later = along.dt > 0.0  # a step repeated at the same time measures nothing new
        felt = ca.DM([-1.0, -damping, 1.0, 0.0])
        for row, measured, variance in (
            (past, along.push, where(later, along.push_density / tick, NO_SAMPLE)),
            (felt, sample, where(both(later, along.felt), along.vibration**2, NO_SAMPLE)),
        ):
            column = covariance @ row
            power = ca.dot(row, column) + variance
            bound = MOST_SIGMAS * ca.sqrt(power)
            innovation = ca.fmin(ca.fmax(measured - ca.dot(row, state), -bound), bound)
            state = state + column / power * innovation
            covariance = covariance - column @ column.T / power
        bounds = ca.vertcat(ca.inf, RATE_BOUND, FORCE_BOUND, mass * SLOW_BOUND)
        state = where(along.touching, ca.fmin(ca.fmax(state, -bounds), bounds), start)
        signals.remember("push_kalman.state", state)
        signals.remember("push_kalman.covariance", ca.tril(covariance).nz[:])
        signals.remember("push_kalman.begun", along.touching)

        elastic, self.rate, self.gust, self.slow = ca.vertsplit(state)
        self.push = where(along.touching, elastic + damping * self.rate, along.push)
        self.external = self.gust + self.slow + mass * along.bias
        force = along.thrust + along.weight + self.gust + self.slow
        self.acceleration = where(along.touching, (force - self.push) / mass, 0.0)

    @staticmethod
    def _gust_weight(signals: Signals, along: Normal, force: ca.SX, learnt: ca.SX) -> ca.SX:
        """Weight of gusts along the normal: 0 in calm air to 1, by the power of the force's changes.

        Those of the whole force and its unlearnt part: in a gust a fast filter leaves less of the force unlearnt than
        the accelerometer's noise, and a weight by that part alone closes as the filter becomes faster.
        """
        begun, fast, slow, left = (signals.state(f"gust_{name}") for name in ("begun", "fast", "slow", "unlearnt"))
        gain = filter_gain(FAST_CHANGE, along.dt)
        # Both begin at the learnt force: a single sample holds the vibration.
        fast = signals.remember("gust_fast", where(begun, fast + gain * (force - fast), learnt))
        changed = slow + filter_gain(SLOW_CHANGE, along.dt) * (fast - slow)
        slow = signals.remember("gust_slow", where(begun, changed, learnt))
        ready = both(along.touching, along.felt)
        signals.remember("gust_begun", ready)
        left = signals.remember("gust_unlearnt", where(begun, left + gain * (force - learnt - left), 0.0))
        squared = ready * ((fast - slow) ** 2 + left**2)
        noise = along.vibration**2 * gain / (2.0 - gain) + along.push_density * FAST_CHANGE / 2.0
        return gust_weight(signals, "gust", along.dt, squared, CHANGE_NOISE * noise, CALM_CHANGE)


def gust_weight(signals: Signals, name: str, dt: ca.SX, squared: ca.SX, noise: ca.SX, calm: float) -> ca.SX:
    """Weight by the mean of a squared force [N^2] beyond noise [N^2]; one half at ``calm`` [N] without noise."""
    power = signals.state(f"{name}_power")
    power = signals.remember(f"{name}_power", power + filter_gain(1.0 / CALM_TIME, dt) * (squared - power))
    gust = ca.fmax(power - NOISE_POWERS * noise, 0.0)
    return gust / (gust + calm**2 + noise)


def filter_gain(bandwidth: ca.SX | float, dt: ca.SX) -> ca.SX:
    """Gain per tick of a first-order filter."""
    return 1.0 - ca.exp(-bandwidth * dt)
