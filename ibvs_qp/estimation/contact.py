"""Contact estimator: wall distance, push, touch and stiffness combined into one `ContactState` per tick."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from ibvs_qp.config import LONGEST_TICK, ContactSettings, ControllerConfig
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.motion_history import MotionHistory
from ibvs_qp.estimation.push import FIRST_PUSH_VARIANCE, PushFilter
from ibvs_qp.estimation.stamps import sample_interval
from ibvs_qp.estimation.stiffness import stiffness
from ibvs_qp.estimation.touch import TouchDetector, touch_threshold
from ibvs_qp.estimation.touch_compliance import MeasuredDistance, touch_compliance
from ibvs_qp.estimation.wall_distance import Plane, Tick, WallDistance
from ibvs_qp.symbolic.function import StepFunction
from ibvs_qp.symbolic.logic import both, either, no, where
from ibvs_qp.symbolic.signals import Signals

#: Without a plane for this long [s], a push means that the tip touches, whatever the drifting distance says.
BLIND_S = 0.3
#: A tip that shall press and is felt to push harder than this [N] touches, although the distance says otherwise: planes
#: since its last start are those of another surface, such as a wall behind the board. Before a contact the tip must
#: also move slower than this along the normal [m/s], for this long [s]: an approach is faster down to 15 mm from the
#: wall, so that a false force makes no contact far from it.
FELT_PUSH, STOPPED_SPEED, STOPPED_S = 2.0, 0.02, 0.1
#: The push noise is learned beyond this multiple of `contact_distance_m`.
FREE_DISTANCES = 2.0
#: A plane, (A, B, C, D); and the least part of its distance at which the tip can touch a surface before it.
Plane4 = tuple[float, float, float, float]
LEAST_RATIO = 0.1
#: Entries of the estimate as results of the function, in the order of `ContactState` behind the normal.
SCALARS = ContactState._fields[1:]
#: Those that are true or false, and those that are infinite while no wall is known.
FLAGS, UNKNOWN = ("known", "in_contact", "stiffness_known"), ("distance", "depth")


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


def depth_weight(settings: ContactSettings, depth: ca.SX) -> ca.SX:
    r"""Lambda without its ramp: :math:`\tfrac12(1+\cos(\pi (d-d_{min})/(d_{max}-d_{min})))`, 1 below and 0 above."""
    ratio = (depth - settings.depth_min_m) / (settings.depth_max_m - settings.depth_min_m)
    return 0.5 * (1.0 + ca.cos(math.pi * ca.fmin(ca.fmax(ratio, 0.0), 1.0)))


class ContactEstimator:
    """Estimates wall normal, tip distance and rate, push, contact and lambda from sensors alone.

    Attributes:
        state: Result of the last update.
        plane_ns: Capture time of the last accepted plane, -1 before the first.
        surface_offset: Distance from the felt surface to the seen one [m], 0 while they are one.

    Args:
        config: Geometry and `contact` settings.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self._config, signals = config, Signals()
        tick = Tick(
            dt=signals.input("dt"),
            elapsed=signals.input("elapsed"),
            rate=signals.input("rate", 3),
            force=signals.input("force", 3),
            force_known=signals.input("force_known"),
            down=signals.input("down", 3),
            doubt=signals.input("doubt"),
        )
        plane = Plane(new=signals.input("plane_new"), age=signals.input("plane_age"), values=signals.input("plane", 4))
        wrench, interval, press = signals.input("wrench", 6), signals.input("interval"), signals.input("press")
        history = MotionHistory(signals, tick.elapsed, tick.rate, tick.acceleration, config.tick_s)
        for name, value in contact_state(signals, config, tick, history, plane, wrench, interval, press).items():
            signals.output(name, value)
        self._step = StepFunction(signals, to_machine_code=config.compiled)
        self._plane = np.array([0.0, 0.0, 1.0, -1.0])
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first measurement."""
        self._step.reset()
        self._stamp = self._wrench_ns = self._plane_ns = self.plane_ns = -1
        self._doubt, self.surface_offset = False, 0.0
        self.state = no_contact(self._config)

    @property
    def touch_threshold(self) -> float:
        """Filtered push that counts as touch [N]."""
        return float(touch_threshold(self._config, self.state.push_noise))

    def doubt(self) -> None:
        """Ticks are missing for an unknown time."""
        self._doubt = True

    def update(
        self,
        *,
        stamp_ns: int,
        angular_velocity: Sequence[float],
        specific_force: Sequence[float] | None,
        down: Sequence[float],
        contact_wrench: np.ndarray,
        wrench_stamp_ns: int,
        plane: Sequence[float] | None,
        plane_stamp_ns: int,
        press: bool = False,
    ) -> ContactState:
        """Update with the sensors of one tick; wrench and plane count once, when their stamps are new.

        Args:
            stamp_ns: Time of the tick.
            angular_velocity: Omega in B [rad/s], (3,).
            specific_force: Accelerometer in B [m/s^2], (3,), or None.
            down: Unit vector of gravity in B, (3,).
            contact_wrench: Tared wrench ON the vehicle at the centre of mass, FRD [N, N m], (6,).
            wrench_stamp_ns: Time at which it was measured.
            plane: (A, B, C, D) of the wall in C, or None.
            plane_stamp_ns: Time at which it was measured.
            press: Whether the tip shall press.
        """
        elapsed = self._config.tick_s if self._stamp < 0 else max((stamp_ns - self._stamp) * 1e-9, 0.0)
        self._stamp = stamp_ns
        new_plane = plane is not None and plane_stamp_ns > self._plane_ns
        if plane is not None and new_plane:
            self._plane_ns, self._plane[:] = plane_stamp_ns, plane
        interval = 0.0
        if wrench_stamp_ns > self._wrench_ns:
            interval, self._wrench_ns = sample_interval(wrench_stamp_ns, self._wrench_ns), wrench_stamp_ns
        self._step.advance()
        self._step.values[:] = (
            min(elapsed, LONGEST_TICK),
            elapsed,
            *angular_velocity,
            *((0.0, 0.0, 0.0) if specific_force is None else specific_force),
            specific_force is not None,
            *down,
            self._doubt,
            new_plane,
            (stamp_ns - self._plane_ns) * 1e-9 if new_plane else 0.0,
            *self._plane,
            *contact_wrench.tolist(),
            interval,
            press,
        )
        self._doubt = False
        self._step.evaluate()
        values = self._step.results.tolist()
        self.state = read_contact(values)
        self.surface_offset, accepted = values[-2:]
        if accepted:
            self.plane_ns = plane_stamp_ns
        return self.state

    def on_felt_surface(self, plane: Plane4) -> Plane4:
        """A measured plane (A, B, C, D) in C, moved to the surface that the tip touches."""
        if self.surface_offset == 0.0:
            return plane
        a, b, c, d = plane
        ratio = max(1.0 - self.surface_offset * math.hypot(a, b, c) / abs(d), LEAST_RATIO)
        return a / ratio, b / ratio, c / ratio, d


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
    state: dict[str, Any] = dict(zip(SCALARS, values[3:], strict=False))
    state |= {name: bool(state[name]) for name in FLAGS}
    if not state["known"]:
        state |= dict.fromkeys(UNKNOWN, math.inf)
    normal = values[0], values[1], values[2]
    return ContactState(normal, **state)
