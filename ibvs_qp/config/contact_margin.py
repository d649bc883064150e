r"""Stability of the contact: vehicle, wall, Kalman filter of the push and force law as one linear loop.

With x the penetration of the undeformed tip, f the push and F the rotors' force, all along the wall normal:

.. math::
    m \ddot x + c \dot x = F - f, \quad f = k x + b \dot x, \quad \tau \dot F = F_c - F.

In every tick the filter (`ibvs_qp.estimation.push_disturbance`) has a force sample of age T_f and the accelerometer,
at the gain of its stationary covariance, and with its forces d, e the law (`ibvs_qp.tasks.push`) commands

.. math::
    F_c = t + k_u (F_c^{last} + d + e - t) - d - e, \quad
    t = -K f - K_{sd} (v + T \dot v) - K_{fi} \textstyle\int f, \quad K = K_{fp} \min(1, k_s / k) + K_{sp} / k.

The command holds until the next tick, so the loop is a difference equation; its poles are those of its transition
matrix. The lag tau is the mean of the rising and the falling one, because an oscillation does both. The arm points at
the wall through the centre of mass, so the force needs no moment and m is the whole mass.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from ibvs_qp.config.contact import LEAST_PUSH_DENSITY, BrushSettings, ContactSettings
from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.gains import Gains
from ibvs_qp.config.vehicle import VehicleParams

#: A preset whose contact mode is damped less than this is refused: a tenth overshoots by 73 % and rings for seconds.
LEAST_DAMPING_RATIO = 0.1
#: Stiffnesses evaluated over a brush's range, evenly spaced in their logarithm.
STIFFNESS_SAMPLES = 7
#: Relative width at which the search for an allowed value stops.
SEARCH_TOLERANCE = 1e-3
#: True over estimated stiffness at which the contact's sensitivity is bounded [-].
STIFFNESS_RATIOS = 0.75, 1.3
#: A pole with a smaller relative imaginary part does not oscillate.
REAL_POLE = 1e-6
#: Gains that a refusal may name, the likeliest cause first.
GAIN_NAMES = ("force_kfp", "force_kfi", "force_ksd", "force_ksp")
#: Faster poles than this part of the tick rate are those of delays [-]; so is a pole at zero.
FASTEST, DEAD = 0.5, 1e-6
#: Frequencies at which the sensitivity is evaluated [rad/s].
FREQUENCIES = np.geomspace(0.1, 700.0, 600)


class ContactLaw(Protocol):
    """Settings of a controller that shape the loop: a `ControllerConfig` has them."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def vehicle(self) -> VehicleParams:
        """Mass, motor lag and drag."""
        ...

    @property
    def gains(self) -> Gains:
        """Gains of the force law."""
        ...

    @property
    def contact(self) -> ContactSettings:
        """Noise and stiffness range of the estimate."""
        ...

    @property
    def brush(self) -> BrushSettings:
        """Stiffness, damping and delay."""
        ...

    @property
    def tick_s(self) -> float:
        """Control period [s]."""
        ...

    @property
    def impedance(self) -> bool:
        """Whether the impedance terms act."""
        ...


class ContactLoop:
    """Transition of the loop over a tick, its poles and its sensitivity; arguments as of `contact_mode_damping`."""

    def __init__(
        self,
        config: ContactLaw,
        stiffness: float,
        damping: float,
        force_delay_s: float,
        vibration_m_s2: float = 0.0,
        gusts: bool = True,
        stiffness_ratio: float = 1.0,
    ) -> None:
        gains, vehicle, contact = config.gains, config.vehicle, config.contact
        self.stiffness, self.damping, self.force_delay = stiffness, damping, force_delay_s
        self.mass, self.lag, self.drag = vehicle.mass_kg, vehicle.motor_lag_s, vehicle.linear_drag_n_s_m
        self.tick, self.lead, self.command_filter = config.tick_s, gains.push_lead_s, gains.push_filter_s
        #: Stiffness of wall and brush in filter and law; their damping, and the age of the force, in the filter.
        self.estimated = stiffness_ratio * stiffness
        self.filter_damping, self.filter_delay = config.brush.damping_n_s_m, config.brush.force_delay_s
        spring, self.damper = (gains.force_ksp, gains.force_ksd) if config.impedance else (0.0, 0.0)
        direct = gains.force_kfp * min(1.0, contact.full_gain_stiffness_n_m / self.estimated)
        self.proportional, self.integral = direct + spring / self.estimated, gains.force_kfi
        self.noise, self.push_density = contact.estimation.push_noise(self.mass, float(gusts)), LEAST_PUSH_DENSITY
        self.vibration = math.hypot(contact.estimation.acceleration_noise / math.sqrt(self.tick), vibration_m_s2)

    def poles(self) -> list[complex]:
        """Poles of the closed loop, upper half plane and real axis [1/s]."""
        matrix, command, row = self._open()
        steps = np.linalg.eigvals(matrix + np.outer(command, row))
        poles = [complex(np.log(step)) / self.tick for step in steps if abs(step) > DEAD]
        fastest = FASTEST * 2.0 * math.pi / self.tick
        return [pole for pole in poles if 0.0 <= pole.imag < fastest and abs(pole) < fastest]

    @property
    def sensitivity(self) -> float:
        """Largest sensitivity M_s of the loop, cut at the rotors' command [-]."""
        matrix, command, row = self._open()
        shift = np.exp(1j * FREQUENCIES[FREQUENCIES < math.pi / self.tick] * self.tick)
        inverse = np.linalg.solve(shift[:, None, None] * np.eye(len(matrix)) - matrix, command[:, None])
        return float(np.max(1.0 / np.abs(1.0 - inverse[:, :, 0] @ row)))

    @property
    def passive_damping_ratio(self) -> float:
        """Damping ratio of vehicle and wall alone, without any feedback."""
        return (self.damping + self.drag) / (2.0 * math.sqrt(self.stiffness * self.mass))

    def _open(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Loop cut at the rotors: transition of a tick, effect of the rotors' command, and the law's command."""
        history = math.ceil(self.force_delay / self.tick) + 1
        size = 10 + history
        columns = np.eye(size + 1)
        following, commanded = self._step(columns[:size], columns[size])
        return following[:, :size], following[:, size], commanded[:size]

    def _step(self, state: np.ndarray, rotors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """One tick, linear in the rows of the state and in the rotors' command: the next state, and the law's command.

        Rows of the state: penetration, speed, rotors' force; that force by the model; elastic push, rate, d, e of the
        filter; integral; last command; past pushes, the newest first.
        """
        x, v, force, modelled, *estimate, integral, last = state[:10]
        push = self.stiffness * x + self.damping * v
        pushes = np.vstack((push, state[10:]))
        whole, part = divmod(self.force_delay / self.tick, 1.0)
        sample = (1.0 - part) * pushes[int(whole)] + part * pushes[int(whole) + 1]
        inertial = force - push - self.drag * v - modelled

        transition, rows, gain = self._filter()
        given = self.tick / self.mass * modelled
        predicted = transition @ np.array(estimate)
        predicted[:2] += self.estimated * self.tick * given, given
        estimate = predicted + gain @ (np.vstack((sample, inertial)) - rows @ predicted)
        felt = estimate[0] + self.filter_damping * estimate[1]
        rate, external = estimate[1], estimate[2] + estimate[3]
        acceleration = (modelled + external - felt) / self.mass
        integral = integral + self.tick * felt
        target = -self.proportional * felt - self.damper * (rate + self.lead * acceleration) - self.integral * integral
        kept = math.exp(-self.tick / self.command_filter) if self.command_filter > 0.0 else 0.0
        command = target + kept * (last + external - target) - external

        follow = 1.0 - math.exp(-self.tick / self.lag)
        plant = self._plant() @ np.vstack((x, v, force, rotors))
        motor = modelled + follow * (command - modelled)
        return np.vstack((plant[:3], motor, estimate, integral, command, pushes[:-1])), command

    def _plant(self) -> np.ndarray:
        """Transition of penetration, speed and force over a tick at a constant command, (4, 4)."""
        from scipy.linalg import expm

        rate = np.zeros((4, 4))
        rate[0, 1] = 1.0
        rate[1, :3] = -self.stiffness / self.mass, -(self.damping + self.drag) / self.mass, 1.0 / self.mass
        rate[2, 2], rate[2, 3] = -1.0 / self.lag, 1.0 / self.lag
        return expm(self.tick * rate)

    def _filter(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Transition, measurement rows and stationary gain of the Kalman filter."""
        from scipy.linalg import solve_discrete_are

        step, damping = self.tick / self.mass, self.filter_damping
        transition = np.eye(4)
        transition[1] = -step, 1.0 - step * damping, step, step
        transition[0] += self.estimated * self.tick * transition[1]
        rows = np.array([[1.0, damping - self.filter_delay * self.estimated, 0, 0], [-1.0, -damping, 1.0, 0]])
        measured = np.diag([self.push_density / self.tick, (self.mass * self.vibration) ** 2])
        covariance = solve_discrete_are(transition.T, rows.T, self.tick * np.diag(self.noise), measured)
        gain = np.linalg.solve(rows @ covariance @ rows.T + measured, rows @ covariance).T
        return transition, rows, gain


@dataclass(frozen=True, kw_only=True)
class LoopMargin:
    """Damping of the least damped mode of the contact.

    Attributes:
        least_damping_ratio: Of all oscillating modes; negative when one grows, -1 when something grows without
            oscillating, 1 when nothing oscillates.
        frequency_hz: Natural frequency of that mode [Hz], 0 when nothing oscillates.
        stiffness_n_m: Wall and brush stiffness it holds for [N/m].
        passive_damping_ratio: Of vehicle and wall alone, without feedback.
    """

    least_damping_ratio: float
    frequency_hz: float
    stiffness_n_m: float
    passive_damping_ratio: float


def contact_mode_damping(
    config: ContactLaw,
    stiffness: float,
    damping: float,
    force_delay_s: float,
    vibration_m_s2: float = 0.0,
    gusts: bool = True,
    believed: float = 1.0,
) -> LoopMargin:
    """Least damping ratio of the contact under a controller; the module derives the loop.

    Args:
        config: Gains, filter, tick, mass and motor lags.
        stiffness: Of wall and brush together [N/m].
        damping: Of wall and brush together [N s/m].
        force_delay_s: Mean age of the force sample in use: latency plus half a sample period [s].
        vibration_m_s2: Of the accelerometer, beyond its noise, standard deviation of a sample [m/s^2].
        gusts: Whether the filter of the push follows gusts; it is slower in calm air.
        believed: Estimated over true stiffness [-].
    """
    loop = ContactLoop(config, stiffness, damping, force_delay_s, vibration_m_s2, gusts, believed)
    ratio, frequency = 1.0, 0.0
    for pole in loop.poles():
        oscillates = abs(pole.imag) > REAL_POLE * abs(pole)
        if oscillates or pole.real > 0.0:
            own = -pole.real / abs(pole) if oscillates else -1.0
            if own < ratio:
                ratio, frequency = own, abs(pole) / (2.0 * math.pi)
    return LoopMargin(
        least_damping_ratio=ratio,
        frequency_hz=frequency,
        stiffness_n_m=stiffness,
        passive_damping_ratio=loop.passive_damping_ratio,
    )


def contact_sensitivity(config: ContactLaw, ratio: float = 1.0) -> float:
    """Largest sensitivity M_s of the contact over the stiffness range of its brush, in gusts and in calm air [-].

    Args:
        config: The controller.
        ratio: True over estimated stiffness [-].
    """
    brush = config.brush
    stiffnesses = np.geomspace(brush.stiffness_min_n_m, brush.stiffness_max_n_m, STIFFNESS_SAMPLES).tolist()
    wall = brush.damping_n_s_m, brush.force_delay_s
    loops = [
        ContactLoop(config, k, *wall, gusts=gusts, stiffness_ratio=1.0 / ratio)
        for k in stiffnesses
        for gusts in (True, False)
    ]
    return max(loop.sensitivity for loop in loops)


def least_margin(config: ContactLaw, brush: BrushSettings | None = None) -> LoopMargin:
    """Least damped contact over the stiffness range of a brush, in gusts and in calm air."""
    brush = brush or config.brush
    config = dataclasses.replace(config, brush=brush)
    low, high = brush.stiffness_min_n_m, brush.stiffness_max_n_m
    samples = set(np.geomspace(low, high, STIFFNESS_SAMPLES).tolist())
    corner = config.contact.full_gain_stiffness_n_m  # the gain begins to fall: possibly the least damped point
    samples |= {corner} if low < corner < high else set()
    wall = brush.damping_n_s_m, brush.force_delay_s
    margins = [contact_mode_damping(config, k, *wall, gusts=g) for k in sorted(samples) for g in (True, False)]
    return min(margins, key=lambda margin: margin.least_damping_ratio)


def require_margin(config: ContactLaw, brush: BrushSettings | None = None, place: str = "") -> LoopMargin:
    """Refuse a controller whose contact would ring.

    Args:
        config: The controller.
        brush: Wall and brush; those of the controller if None.
        place: Prefix of the field's name in messages: "preset.toml: controller.".

    Returns:
        The least margin over the brush's stiffness range.

    Raises:
        ConfigError: Naming the gain (or, where no gain helps, the stiffness or the damping), its value and range.
    """
    brush = brush or config.brush
    margin = least_margin(config, brush)
    if margin.least_damping_ratio >= LEAST_DAMPING_RATIO:
        return margin
    reason = (
        f"for a contact damped at least {LEAST_DAMPING_RATIO:g}; it is {margin.least_damping_ratio:.3f} at "
        f"{margin.stiffness_n_m:.0f} N/m and {margin.frequency_hz:.1f} Hz, {margin.passive_damping_ratio:.3f} without "
        "feedback"
    )

    def damped_with(section: Gains | BrushSettings, name: str, value: float) -> bool:
        changed = dataclasses.replace(section, **{name: value})
        gains, pressed = (changed, brush) if isinstance(changed, Gains) else (config.gains, changed)
        return (
            least_margin(dataclasses.replace(config, gains=gains), pressed).least_damping_ratio >= LEAST_DAMPING_RATIO
        )

    for name in GAIN_NAMES:
        value = getattr(config.gains, name)
        if value > 0.0 and damped_with(config.gains, name, 0.0):
            allowed = _search(0.0, value, functools.partial(damped_with, config.gains, name))
            unit = Gains.__dataclass_fields__[name].metadata["unit"]
            words = " ".join(filter(None, (f"allowed is [0, {allowed:.4g}]", unit, reason)))
            raise out_of_range(f"{place}gains.{name}", value, unit, words)
    low, high = brush.stiffness_min_n_m, brush.stiffness_max_n_m
    if damped_with(brush, "stiffness_max_n_m", low):
        allowed = _search(low, high, functools.partial(damped_with, brush, "stiffness_max_n_m"))
        words = f"allowed is [{low:g}, {allowed:.0f}] N/m {reason}"
        raise out_of_range(f"{place}brush.stiffness_max_n_m", high, "N/m", words)
    words = f"too little {reason}; no one gain mends it"
    raise out_of_range(f"{place}brush.damping_n_s_m", brush.damping_n_s_m, "N s/m", words)


def _search(good: float, bad: float, accepts: Callable[[float], bool]) -> float:
    """Largest accepted value between a good and a bad one, by bisection."""
    width = SEARCH_TOLERANCE * abs(bad - good)
    while abs(bad - good) > width:
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if accepts(middle) else (good, middle)
    return good
