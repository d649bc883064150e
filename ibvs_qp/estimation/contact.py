"""Contact: push, touch and its loss, with distance and stiffness of the wall as one `ContactState` per tick."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import casadi as ca

from ibvs_qp.config import ContactSettings, ControllerConfig
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.motion_history import MotionHistory
from ibvs_qp.estimation.stiffness import MeasuredDistance, stiffness, touch_compliance
from ibvs_qp.estimation.wall_distance import NEVER_S, Plane, Tick, WallDistance
from ibvs_qp.symbolic.logic import both, either, no, where
from ibvs_qp.symbolic.signals import Signals

#: Without a plane for this long [s], a push means contact, at any value of the drifting distance.
BLIND_S = 0.3
#: While a press is commanded, a measured push above this [N] means contact at any distance: the planes since the last
#: start then belong to another surface, such as a wall behind the board. Before a contact the tip must also move slower
#: than this along the normal [m/s], for this long [s]: an approach is faster down to 15 mm from the wall, so that a
#: false force makes no contact far from it.
FELT_PUSH, STOPPED_SPEED, STOPPED_S = 2.0, 0.02, 0.1
#: The push noise is learned beyond this multiple of `contact_distance_m`.
FREE_DISTANCES = 2.0
#: Entries of the estimate as results of the function, in the order of `ContactState` behind the normal.
SCALARS = ContactState._fields[1:]
#: Places of those that are true or false, and of those that are infinite while no wall is known.
_FLAGS = tuple(SCALARS.index(name) for name in ("known", "in_contact", "stiffness_known"))
_UNKNOWN = tuple(SCALARS.index(name) for name in ("distance", "depth"))
#: Variance of the filtered push before free flight shows it [N^2].
FIRST_PUSH_VARIANCE = 0.02


def contact_state(
    signals: Signals,
    config: ControllerConfig,
    tick: Tick,
    history: MotionHistory,
    plane: Plane,
    wrench: ca.SX,
    interval: ca.SX,
    press: ca.SX,
) -> dict[str, ca.SX]:
    """The estimate of one tick as expressions, by the names of `ContactState`.

    Args:
        signals: Registry.
        config: Geometry and `contact` settings.
        tick: Inertial data.
        history: Motion up to this tick.
        plane: Last measured plane.
        wrench: Tared wrench ON the vehicle at the centre of mass, FRD [N, N m], (6,).
        interval: Time since the last force sample [s], 0 without a new one.
        press: Whether the tip shall press.
    """
    settings, estimation = config.contact, config.contact.estimation
    touch = TouchDetector(signals, config, tick.dt)
    wall = WallDistance(signals, config, tick, history)
    standing_s = touch.time - plane.age + 0.5 * config.tick_s  # times are whole ticks: rounding must not decide
    wall.correct(plane, both(touch.in_contact, standing_s > estimation.stationary_after_s))
    stopped_s = signals.state("contact.stopped_s")
    far = wall.distance > FREE_DISTANCES * settings.contact_distance_m
    free = both(no(touch.in_contact), far, stopped_s <= 0.0)
    push = PushFilter(signals, settings, wrench, interval, wall.normal, free)
    touch.add_sample(interval > 0.0, push.push, push.push_noise)
    beyond = wall.distance > settings.contact_distance_m
    felt = both(press, wall.anew, beyond, push.push > ca.fmax(FELT_PUSH, settings.touch_sigmas * push.push_noise))
    stopped = both(felt, no(touch.in_contact), ca.fabs(wall.rate) < STOPPED_SPEED)
    stopped_s = signals.remember("contact.stopped_s", where(stopped, stopped_s + tick.dt, 0.0))
    another = both(touch.pressed, either(both(felt, touch.in_contact), stopped_s >= STOPPED_S))
    blind = both(interval > 0.0, touch.pressed, wall.known, wall.since_plane > BLIND_S)
    wall.touch(either(blind, another), both(another, no(blind)))
    touch.update(push.push, wall.distance)
    seen = MeasuredDistance(wall.accepted, wall.measured, wall.distance, wall.distance_variance, wall.set_anew)
    softest = config.brush.stiffness_min_n_m
    slope = stiffness(
        signals,
        settings,
        dt=tick.dt,
        push=push.push,
        push_noise=push.push_noise,
        acceleration=ca.dot(wall.normal, tick.acceleration) - wall.bias,
        lever_speed=wall.lever_speed,
        speed=-wall.rate,
        variance=wall.variance,
        touching=touch.in_contact,
        felt=tick.force_known,
        by_planes=touch_compliance(
            signals, estimation, seen, dt=tick.dt, push=push.push, touching=touch.in_contact, softest_n_m=softest
        ),
    )
    wall.store(both(touch.in_contact, wall.distance <= settings.contact_distance_m))
    return {
        "normal": wall.normal,
        "known": wall.known,
        "distance": wall.distance,
        "rate": wall.rate,
        "acceleration": wall.acceleration,
        "rate_noise": wall.rate_noise,
        "acceleration_noise": ca.sqrt(wall.variance),
        "bias": wall.bias,
        "speed": wall.speed,
        "depth": wall.depth,
        "push": push.push,
        "push_noise": push.push_noise,
        "across_noise": push.moment_noise / config.vehicle.tip_position_m[0],
        "in_contact": touch.in_contact,
        "time_since_touch": touch.time,
        "ramp": touch.ramp,
        "contact_weight": touch.ramp * depth_weight(settings, wall.depth),
        "stiffness": slope.value,
        "stiffness_known": slope.known,
        "surface_offset": wall.offset,
        "plane_accepted": wall.accepted,
    }


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


def touch_threshold(config: ControllerConfig, push_noise: ca.SX | float) -> ca.SX | float:
    """Filtered push that counts as touch [N], given its standard deviation in free flight [N]."""
    least, noise = config.contact.touch_force_n, config.contact.touch_sigmas * push_noise
    return max(least, noise) if isinstance(noise, float) else ca.fmax(least, noise)


class TouchDetector:
    """State machine of two states, free and in contact.

    - Free to contact: `touch_samples` force samples in a row exceed the threshold while the tip is nearer to the wall
      than `contact_distance_m`.
    - Contact to free: the push stays below `loss_force_n` for `loss_time_s`, or the tip is farther away than
      `contact_distance_m`.

    Attributes:
        in_contact: The state; before `update` that of the last tick.
        time: Time in contact [s], 0 while free.
        pressed: After `add_sample`, whether enough force samples in a row exceeded the threshold.

    Args:
        signals: Registry.
        config: Its `contact` settings and the switch `touch_ramp`.
        dt: Bounded time since the last tick [s]: a stamp far ahead must not end the ramp.
    """

    def __init__(self, signals: Signals, config: ControllerConfig, dt: ca.SX) -> None:
        self._signals, self._config, self._settings = signals, config, config.contact
        state = signals.state
        self.in_contact, self._samples = state("touch.in_contact"), state("touch.samples")
        self.time = self.in_contact * (state("touch.time") + dt)
        self._since_loss = state("touch.since_loss", start=NEVER_S) + dt
        self._weak_for = state("touch.weak_for") + dt
        self._weak = state("touch.weak")
        self._ramp_start = state("touch.ramp_start")  # where the ramp of this contact starts, or the last one stopped

    def add_sample(self, new: ca.SX, push: ca.SX, push_noise: ca.SX) -> None:
        """Count a filtered force sample [N] towards a touch, if it is new."""
        above = push > touch_threshold(self._config, push_noise)
        self._samples = where(new, where(above, self._samples + 1.0, 0.0), self._samples)
        self.pressed = self._samples >= self._settings.touch_samples

    def update(self, push: ca.SX, distance: ca.SX) -> None:
        """Decide on touch and loss by filtered push [N] and distance of the tip [m]."""
        settings, estimation = self._settings, self._settings.estimation
        touches = both(no(self.in_contact), self.pressed, distance < settings.contact_distance_m)
        bounced = self._since_loss < estimation.bounce_time_s
        latest = where(bounced, estimation.bounce_ramp * settings.ramp_s, 0.0)

        weak = both(self.in_contact, push < settings.loss_force_n)
        weak_for = where(self._weak, self._weak_for, 0.0)
        lost = both(
            self.in_contact,
            either(both(weak, weak_for >= settings.loss_time_s), distance > settings.contact_distance_m),
        )
        start = where(touches, ca.fmin(self._ramp_start, latest), self._ramp_start + where(lost, self.time, 0.0))
        self.in_contact = where(lost, 0.0, either(self.in_contact, touches))
        self.time = where(either(touches, lost), 0.0, self.time)
        for name, value in {
            "in_contact": self.in_contact,
            "samples": where(lost, 0.0, self._samples),
            "time": self.time,
            "since_loss": where(lost, 0.0, ca.fmin(self._since_loss, NEVER_S)),
            "weak": weak,
            "weak_for": weak_for,
            "ramp_start": start,
        }.items():
            self._signals.remember(f"touch.{name}", value)
        self._ramp_start = start

    @property
    def ramp(self) -> ca.SX:
        """0 at touch to 1 after `ramp_s`, and 0 while free; always 1 without `touch_ramp`.

        After a loss of less than `bounce_time_s` it resumes where it stopped.
        """
        if not self._config.touch_ramp:
            return ca.SX(1.0)
        return self.in_contact * ca.fmin((self._ramp_start + self.time) / self._settings.ramp_s, 1.0)


def depth_weight(settings: ContactSettings, depth: ca.SX) -> ca.SX:
    r"""Lambda without its ramp: :math:`\tfrac12(1+\cos(\pi (d-d_{min})/(d_{max}-d_{min})))`, 1 below and 0 above."""
    ratio = (depth - settings.depth_min_m) / (settings.depth_max_m - settings.depth_min_m)
    return 0.5 * (1.0 + ca.cos(math.pi * ca.fmin(ca.fmax(ratio, 0.0), 1.0)))


def no_contact(config: ControllerConfig) -> ContactState:
    """The estimate before the first measurement."""
    return ContactState(
        normal=(1.0, 0.0, 0.0),
        known=False,
        distance=math.inf,
        rate=0.0,
        acceleration=0.0,
        rate_noise=0.0,
        acceleration_noise=0.0,
        bias=0.0,
        speed=0.0,
        depth=math.inf,
        push=0.0,
        push_noise=math.sqrt(FIRST_PUSH_VARIANCE),
        across_noise=0.0,
        in_contact=False,
        time_since_touch=0.0,
        ramp=0.0 if config.touch_ramp else 1.0,
        contact_weight=0.0,
        stiffness=config.contact.estimation.assumed_stiffness_n_m,
        stiffness_known=False,
    )


def read_contact(values: Sequence[float]) -> ContactState:
    """The estimate from the results of `contact_state` in their order: the normal first."""
    x, y, z, *numbers = values[: 3 + len(SCALARS)]
    state: list[Any] = numbers
    for place in _FLAGS:
        state[place] = state[place] != 0.0
    if not state[_FLAGS[0]]:
        for place in _UNKNOWN:
            state[place] = math.inf
    return ContactState((x, y, z), *state)
