"""Least damping ratio of the contact mode of a controller and a brush, and the check of a preset."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from ibvs_qp.analysis.contact_loop import ContactLoop
from ibvs_qp.config.brush import BrushSettings
from ibvs_qp.config.contact import ContactSettings
from ibvs_qp.config.contact_estimation import LEAST_PUSH_DENSITY
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


class _PressingConfig(Protocol):
    """The part of `ibvs_qp.config.ControllerConfig` that shapes the contact."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def vehicle(self) -> VehicleParams: ...

    @property
    def gains(self) -> Gains: ...

    @property
    def contact(self) -> ContactSettings: ...

    @property
    def brush(self) -> BrushSettings: ...

    @property
    def tick_s(self) -> float: ...

    @property
    def impedance(self) -> bool: ...


def contact_loop(
    config: _PressingConfig,
    stiffness: float,
    damping: float,
    force_delay_s: float,
    vibration_m_s2: float = 0.0,
    gusts: bool = True,
    believed: float = 1.0,
) -> ContactLoop:
    """The linear contact loop of a controller against a wall; arguments as in `contact_mode_damping`."""
    gains, vehicle, brush = config.gains, config.vehicle, config.brush
    known = believed * stiffness
    spring, damper = (gains.force_ksp, gains.force_ksd) if config.impedance else (0.0, 0.0)
    return ContactLoop(
        mass=vehicle.mass_kg,
        lag=vehicle.motor_lag_s,
        tick=config.tick_s,
        lead=gains.push_lead_s,
        command_filter=gains.push_filter_s,
        drag=vehicle.linear_drag_n_s_m,
        stiffness=stiffness,
        believed=known,
        damping=damping,
        believed_damping=brush.damping_n_s_m,
        proportional=gains.force_kfp * min(1.0, config.contact.full_gain_stiffness_n_m / known) + spring / known,
        integral=gains.force_kfi,
        damper=damper,
        noise=config.contact.estimation.push_noise(vehicle.mass_kg, float(gusts)),
        force_delay=force_delay_s,
        believed_delay=brush.force_delay_s,
        push_density=LEAST_PUSH_DENSITY,
        vibration=math.hypot(config.contact.estimation.acceleration_noise / math.sqrt(config.tick_s), vibration_m_s2),
    )


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
    config: _PressingConfig,
    stiffness: float,
    damping: float,
    force_delay_s: float,
    vibration_m_s2: float = 0.0,
    gusts: bool = True,
    believed: float = 1.0,
) -> LoopMargin:
    """Least damping ratio of the contact under a controller; `ContactLoop` derives the loop.

    Args:
        config: Gains, filter, tick, mass and motor lags.
        stiffness: Of wall and brush together [N/m].
        damping: Of wall and brush together [N s/m].
        force_delay_s: Mean age of the force sample in use: latency plus half a sample period [s].
        vibration_m_s2: Of the accelerometer, beyond its noise, standard deviation of a sample [m/s^2].
        gusts: Whether the filter of the push follows gusts; it is slower in calm air.
        believed: Estimated over true stiffness [-].
    """
    loop = contact_loop(config, stiffness, damping, force_delay_s, vibration_m_s2, gusts, believed)
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


def contact_sensitivity(config: _PressingConfig, ratio: float = 1.0) -> float:
    """Largest sensitivity M_s of the contact over the stiffness range of its brush, in gusts and in calm air [-].

    Args:
        config: The controller.
        ratio: True over estimated stiffness [-].
    """
    brush = config.brush
    return max(
        contact_loop(
            config, float(k), brush.damping_n_s_m, brush.force_delay_s, gusts=gusts, believed=1.0 / ratio
        ).sensitivity
        for k in np.geomspace(brush.stiffness_min_n_m, brush.stiffness_max_n_m, STIFFNESS_SAMPLES)
        for gusts in (True, False)
    )


def least_margin(config: _PressingConfig, brush: BrushSettings | None = None) -> LoopMargin:
    """Least damped contact over the stiffness range of a brush, in gusts and in calm air."""
    brush = brush or config.brush
    config = dataclasses.replace(config, brush=brush)
    low, high = brush.stiffness_min_n_m, brush.stiffness_max_n_m
    samples = {float(entry) for entry in np.geomspace(low, high, STIFFNESS_SAMPLES)}
    corner = config.contact.full_gain_stiffness_n_m  # the gain begins to fall: possibly the least damped point
    samples |= {corner} if low < corner < high else set()
    margins = (
        contact_mode_damping(config, k, brush.damping_n_s_m, brush.force_delay_s, gusts=gusts)
        for k in sorted(samples)
        for gusts in (True, False)
    )
    return min(margins, key=lambda margin: margin.least_damping_ratio)


def require_margin(config: _PressingConfig, brush: BrushSettings | None = None, place: str = "") -> LoopMargin:
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

    def good(changed: _PressingConfig, pressed: BrushSettings) -> bool:
        return least_margin(changed, pressed).least_damping_ratio >= LEAST_DAMPING_RATIO

    def with_gain(name: str, value: float) -> bool:
        return good(dataclasses.replace(config, gains=dataclasses.replace(config.gains, **{name: value})), brush)

    for name in GAIN_NAMES:
        value = getattr(config.gains, name)
        if value > 0.0 and with_gain(name, 0.0):
            allowed = _search(0.0, value, lambda entry, name=name: with_gain(name, entry))
            unit = type(config.gains).__dataclass_fields__[name].metadata["unit"]
            words = " ".join(filter(None, (f"allowed is [0, {allowed:.4g}]", unit, reason)))
            raise out_of_range(f"{place}gains.{name}", value, unit, words)
    low, high = brush.stiffness_min_n_m, brush.stiffness_max_n_m
    if good(config, dataclasses.replace(brush, stiffness_max_n_m=low)):
        allowed = _search(low, high, lambda k: good(config, dataclasses.replace(brush, stiffness_max_n_m=k)))
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
