"""Figures of a static press: touch, settling, steady push, height and attitude."""

from __future__ import annotations

import functools
import math

import numpy as np

import allocation
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.evaluate.measures.paint import effort_figures
from sim.evaluate.window import (
    BOUNCE_WINDOW_S,
    CONTACT_N,
    PHYSICS_RATE_HZ,
    attitude_figures,
    board_tip,
    contact_clock,
    event_time,
    limited_fraction,
    mean,
    peak,
    phase_window,
    rms,
    touch_figures,
)
from sim.flight.trace import Trace

#: Steady figures begin this long after the touch, or after a fault [s]: ramp and transients are over.
STEADY_AFTER_S = 4.0
#: The approach speed is read over this time before the first touch [s].
APPROACH_WINDOW_S = 0.05
#: A disturbed press has recovered when push and path stay within these bands [N, m].
RECOVERY_BAND_N, RECOVERY_BAND_M = 0.5, 0.005
#: Direction of travel of a sliding tip in B.
_LEFT = np.array([0.0, -1.0, 0.0])


@functools.lru_cache(maxsize=256)
def push_reach(
    mass_kg: float, lower_n: tuple[float, ...], upper_n: tuple[float, ...], sliding_friction: float = 0.0
) -> float:
    """Largest push in level flight that the rotors can hold at full lift without turning the vehicle [N].

    Args:
        mass_kg: True mass.
        lower_n: Lower thrust limits of the rotors.
        upper_n: Upper thrust limits of the rotors.
        sliding_friction: Coulomb coefficient of a tip that slides to the left; 0 for a tip at rest.
    """
    vehicle = VehicleParams()
    return allocation.push_reach(
        vehicle.geometry,
        mass_kg * GRAVITY,
        np.array(vehicle.tip_position_m),
        np.array(lower_n),
        np.array(upper_n),
        friction=sliding_friction,
        travel=_LEFT if sliding_friction > 0.0 else None,
    ).push


def push_figures(trace: Trace, push: np.ndarray, commanded: float, sliding_friction: float = 0.0) -> dict[str, float]:
    """Delivered push with the commanded one, the job's, and the reach of the true limits at the end of the flight.

    Args:
        trace: The flight.
        push: True push over the steady part [N], (K,).
        commanded: Mean commanded push over the same part [N].
        sliding_friction: Coulomb coefficient if the tip slides, else 0.
    """
    job, delivered = trace.scene.paint.push_n, mean(push)
    lower, upper = (tuple(map(float, trace.arrays[f"true_thrust_{side}"])) for side in ("min", "max"))
    reach = push_reach(trace.true_mass.item(), lower, upper, sliding_friction)
    return {
        "push_mean_n": delivered,
        "push_commanded_n": commanded,
        "force_error_rms_n": rms(push - job),
        "force_std_n": float(np.std(push)) if len(push) else math.nan,
        "delivered_share": delivered / job,
        "reach_n": reach,
        "reach_share": delivered / max(min(reach, job), 1e-9),
    }


def press_figures(trace: Trace) -> dict[str, float]:
    """Figures of the phase ``press`` of a flight with `sim.flight.jobs.PressJob`; NaN if the flight ended earlier."""
    begin, end = phase_window(trace, "press")
    clock = contact_clock(trace)
    window = (clock >= begin) & (clock <= end)
    clock, contact = clock[window], trace.contact_1khz[window]
    touching = contact > CONTACT_N
    fault = event_time(trace, "fault")
    if not touching.any():
        return {"touched": 0.0, **attitude_figures(trace, (trace.t >= begin) & (trace.t <= end))}
    first = int(np.argmax(touching))
    touch = float(clock[first])
    steady_from = (touch if math.isnan(fault) else fault) + STEADY_AFTER_S
    steady = clock >= steady_from
    after_touch = (trace.t >= touch) & (trace.t <= end)
    late = (trace.t >= clock[0]) & (trace.t <= end) & (trace.t >= steady_from)
    push, commanded = contact[steady], mean(trace.push_reference[late])
    figures = {
        "touched": 1.0,
        **{name: float(value) for name, value in touch_figures(trace, contact, clock).items()},
        "touch_peak_n": peak(contact[first : first + round(BOUNCE_WINDOW_S * PHYSICS_RATE_HZ)]),
        "force_peak_n": peak(contact),
        "contact_share": mean(touching[steady].astype(float)),
        "force_rms_n": rms(push - commanded),
        **push_figures(trace, push, commanded),
        "approach_speed_m_s": _approach_speed(trace, touch),
        **attitude_figures(trace, after_touch),
        **_position(trace, after_touch, late),
        **_effort(trace, late),
    }
    return figures | (_recovery(trace, fault, end) if not math.isnan(fault) else {})


def press_row(trace: Trace) -> dict[str, float]:
    """Figures of a press with the effort."""
    return press_figures(trace) | effort_figures(trace)


def _approach_speed(trace: Trace, touch: float) -> float:
    """Speed towards the wall just before the first touch [m/s]."""
    before = np.flatnonzero((trace.t < touch) & (trace.t > touch - APPROACH_WINDOW_S))
    if len(before) < 2:
        return math.nan
    first, last = before[0], before[-1]
    return float((trace.tip[last, 0] - trace.tip[first, 0]) / (trace.t[last] - trace.t[first]))


def _position(trace: Trace, after_touch: np.ndarray, late: np.ndarray) -> dict[str, float]:
    """Height above the guide's target, and motion of the tip along the board after the touch."""
    tip = board_tip(trace)
    height = tip[:, 1] - trace.scene.paint.edge_margin_m
    along = tip[after_touch, 0] - tip[after_touch, 0][0] if after_touch.any() else np.array([])
    return {
        "height_error_rms_m": rms(height[after_touch]),
        "height_error_peak_m": peak(height[after_touch]),
        "height_error_steady_m": mean(height[late]),
        "slip_peak_m": peak(along),
        "path_rms_m": rms(np.hypot(height[after_touch], along)),
    }


def _effort(trace: Trace, late: np.ndarray) -> dict[str, float]:
    """Steady part: mean rotor force in B, fraction of ticks with an active limit."""
    wrench = trace.thrusts_actual[late] @ allocation.control_effectiveness(allocation.TAROT_T960).T
    names = ("thrust_front_n", "thrust_right_n", "thrust_down_n")
    figures = {name: mean(wrench[:, axis]) for axis, name in enumerate(names)}
    return figures | {"limited_share": limited_fraction(trace, late)}


def _recovery(trace: Trace, fault: float, end: float) -> dict[str, float]:
    """Largest deviation after a fault, and the time after which push and position stay within their bands."""
    inside = (trace.t >= fault) & (trace.t <= end)
    if not inside.any():
        return {}
    t, tip = trace.t[inside], board_tip(trace)[inside]
    offset = np.linalg.norm(tip - tip[0], axis=1)
    error = np.abs(trace.push_true[inside] - trace.push_reference[inside])
    outside = np.flatnonzero((error > RECOVERY_BAND_N) | (offset > RECOVERY_BAND_M))
    back = 0.0 if not len(outside) else math.nan if outside[-1] == len(t) - 1 else float(t[outside[-1] + 1] - fault)
    return {"recovery_s": back, "fault_force_peak_n": peak(error), "fault_path_peak_m": peak(offset)}
