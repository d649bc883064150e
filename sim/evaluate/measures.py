"""Figures of one flight as a flat row, from its trace: paint jobs, presses, slides, lost rotors, faults."""

from __future__ import annotations

import functools
import math

import numpy as np

import allocation
from ibvs_qp.command import SafetyState
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.evaluate.figures import FIGURES
from sim.evaluate.part import Part
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
    tilt_deg,
    touch_figures,
)
from sim.flight.trace import CRASH, LANDED, Trace
from sim.world.board import BoardGeometry

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


#: States of the supervisor in the order of severity; a figure holds a state as its place in this list.
STATES = tuple(SafetyState)
#: A rotor differs from its command beyond this [N]: the least thrust that the monitor of rotors may miss
#: (`safety.missing_thrust_n`); wrong gains of sound rotors make up 1 N.
DEVIATION_N = 2.5
#: The attitude is scored from this time on [s]: the vehicle is released at hover.
SETTLED_S = 1.0


def fault_figures(trace: Trace) -> dict[str, float]:
    """Figures of the whole flight, and times from the fault.

    Returns:
        ``struck``: 1 if the fault occurred. ``fault_s``: when. ``tilt_peak_deg``, ``tilt_contact_deg`` (in contact),
        ``push_peak_n`` (1 kHz), ``speed_peak_m_s``, ``clearance_min_m``. ``away_m``, ``advance_m``: farthest from
        where the fault struck, and towards the wall. ``deviates_s``: from the fault until some rotor first differs
        from its command, see `DEVIATION_N`. ``touching_s``: from the fault to the last contact. ``crashed``,
        ``landed``: 1 if the flight ended so. ``bad_thrusts``: ticks with a thrust that is not finite.
        ``box_excess_n``: largest excess over the limits of the vehicle. ``rate_peak_n_s``: fastest change of a thrust.
        ``state``: most severe state from the fault on; ``state_before``: likewise before it. ``to_STATE_s``: from the
        fault to that state or a more severe one. ``unexplained``: changes of state without a reason.
    """
    fault = event_time(trace, "fault")
    if not len(trace.t):
        return {"struck": 0.0}
    touching = trace.contact_1khz.reshape(len(trace.t), -1).max(axis=1) > CONTACT_N
    tilt, flown = tilt_deg(trace), trace.t >= SETTLED_S
    after = trace.t >= fault if not math.isnan(fault) else np.zeros(len(trace.t), bool)
    origin = trace.position[after][:1]
    return {
        "struck": float(not math.isnan(fault)),
        "fault_s": fault,
        "end_s": float(trace.t[-1]),
        "tilt_peak_deg": peak(tilt[flown]),
        "tilt_contact_deg": peak(tilt[flown & touching]),
        "push_peak_n": peak(trace.contact_1khz),
        "push_time_s": float(contact_clock(trace)[np.argmax(trace.contact_1khz)]),
        "speed_peak_m_s": peak(np.linalg.norm(trace.velocity, axis=1)),
        "clearance_min_m": float(np.min(trace.propeller_clearance)),
        "touching_s": float(max(trace.t[touching], default=-math.inf)) - fault,
        "away_m": peak(np.linalg.norm(trace.position[after] - origin, axis=1)),
        "advance_m": max((trace.position[after] - origin)[:, 0], default=math.nan),
        "deviates_s": _deviation(trace, fault),
        "crashed": float(trace.reason.startswith(CRASH)),
        "landed": float(trace.reason == LANDED),
        **_commands(trace),
        **_states(trace, fault),
    }


def _deviation(trace: Trace, fault: float) -> float:
    """Time from the fault until a true thrust first differs from its command behind the motor lag [s]; NaN if never."""
    if len(trace.t) < 2:
        return math.nan
    vehicle = VehicleParams()
    tick_s = float(np.median(np.diff(trace.t)))
    rise, fall = (1.0 - math.exp(-tick_s / lag) for lag in (vehicle.motor_lag_up_s, vehicle.motor_lag_down_s))
    lagged = trace.thrusts_actual[0].copy()
    for when, command, true in zip(trace.t, trace.thrusts, trace.thrusts_actual, strict=True):
        step = command - lagged
        lagged += np.where(step > 0.0, rise, fall) * step
        if when >= fault and np.abs(lagged - true).max() > DEVIATION_N:
            return float(when - fault)
    return math.nan


def _commands(trace: Trace) -> dict[str, float]:
    """Whether every commanded thrust is finite, within the limits of the vehicle, and how fast they change."""
    thrusts = trace.thrusts
    finite = np.isfinite(thrusts).all(axis=1)
    good = thrusts[finite]
    excess = np.maximum(good - trace.thrust_max, trace.thrust_min - good)
    tick_s = float(np.median(np.diff(trace.t))) if len(trace.t) > 1 else math.inf
    return {
        "bad_thrusts": float(np.count_nonzero(~finite)),
        "box_excess_n": max(float(excess.max()), 0.0) if len(good) else 0.0,
        "rate_peak_n_s": peak(np.diff(good, axis=0)) / tick_s if len(good) > 1 else 0.0,
    }


def _states(trace: Trace, fault: float) -> dict[str, float]:
    """Most severe state before and after the fault, times to each, and changes without a reason."""
    changes = [(event.t, *event.text.partition(":")[::2]) for event in trace.events if event.kind == "safety"]
    states = [(when, STATES.index(SafetyState(name)), reason.strip()) for when, name, reason in changes]
    figures = {
        "state_before": float(max((state for when, state, _ in states if when < fault), default=0)),
        "state": float(max((state for when, state, _ in states if when >= fault), default=0)),
        "unexplained": float(sum(1 for _, state, reason in states if state and not reason)),
    }
    for least, name in enumerate(STATES[1:], start=1):
        reached = (when - fault for when, state, _ in states if state >= least and when >= fault)
        figures[f"to_{name}_s"] = next(reached, math.nan)
    return figures


#: Sliding figures begin this long after the slide command [s]: the speed ramp is over.
SLIDING_AFTER_S = 1.0
#: A tip slower than this fraction of the commanded speed counts as stuck.
STUCK_FRACTION = 0.2
#: A slide is held at this fraction of its speed and of its push [-]: both together, as one is easy without the other.
HELD_SPEED, HELD_PUSH = 0.9, 0.95
#: Start of the text by which a command rejects a push beyond reach.
_REDUCED = "reference.push_force"


def slide_figures(trace: Trace) -> dict[str, float]:
    """Figures of the phase ``paint`` of a flight that slides, after those of the press before it.

    The flight has a `sim.flight.jobs.PressJob` with a slide. Figures of the press have the prefix ``hold_``.
    """
    hold = {f"hold_{name}": value for name, value in press_figures(trace).items()}
    begin, end = phase_window(trace, "paint")
    whole = (trace.t >= begin) & (trace.t <= end)
    after = whole & (trace.t >= begin + SLIDING_AFTER_S)
    if not after.any():
        return hold
    tip, t, push = board_tip(trace), trace.t, trace.push_true[after]
    target_speed = trace.scene.paint.speed_m_s
    last, first = np.flatnonzero(after)[[-1, 0]]
    speed = float((tip[first, 0] - tip[last, 0]) / (t[last] - t[first])) if last > first else math.nan
    height = tip[:, 1] - trace.scene.paint.edge_margin_m
    reference = trace.push_reference[after]
    reduced = any(event.kind == "rejected" and event.text.startswith(_REDUCED) for event in trace.events)
    return hold | {
        **attitude_figures(trace, after, whole),
        "speed_m_s": speed,
        "slide_held": float(speed >= HELD_SPEED * target_speed and mean(push) >= HELD_PUSH * trace.scene.paint.push_n),
        "speed_error_share": abs(speed - target_speed) / target_speed,
        "stuck_share": float(np.mean(-np.gradient(tip[after, 0], t[after]) < STUCK_FRACTION * target_speed)),
        "path_rms_m": rms(height[after]),
        "reduced_said": float(reduced),
        "force_rms_n": rms(push - reference),
        **push_figures(trace, push, mean(reference), trace.scene.wall.friction),
        "height_error_peak_m": peak(height[after]),
        "contact_share": float(np.mean(push > CONTACT_N)),
        "friction_mean_n": mean(np.linalg.norm(trace.friction_true[after], axis=1)),
        "limited_share": limited_fraction(trace, after),
    }


#: The vehicle counts as detached when its tip is this far from the board at the end [m].
DETACHED_M = 0.10


def loss_figures(trace: Trace) -> dict[str, float]:
    """Figures from the loss to the end of the flight.

    Returns:
        ``survived_s``: from the loss to the crash, the landing or the planned end. ``yaw_turned_deg``: largest turn
        from the heading at the loss, full turns included. ``push_spike_n``: largest push after the loss. Empty without
        a fault.
    """
    fault = event_time(trace, "fault")
    after = trace.t >= fault if not math.isnan(fault) else np.zeros(len(trace.t), bool)
    if not after.any():
        return {}
    down = _rate(trace.position[after] @ BoardGeometry(trace.scene).down, trace.t[after])
    touching = trace.push_true[after] > CONTACT_N
    return {
        "survived_s": float(trace.t[-1] - fault),
        "tilt_peak_deg": peak(tilt_deg(trace)[after]),
        "yaw_turned_deg": peak(np.degrees(np.unwrap(trace.euler[after, 2]) - trace.euler[after, 2][0])),
        "yaw_rate_peak_deg_s": peak(np.degrees(_rate(np.unwrap(trace.euler[after, 2]), trace.t[after]))),
        "push_spike_n": peak(trace.contact_1khz[contact_clock(trace) >= fault]),
        "descent_peak_m_s": float(np.max(down)),
        "detached": float(-trace.tip[-1, 0] > DETACHED_M and not touching[-1]),
        "contact_after_s": float(np.count_nonzero(touching)) * float(np.median(np.diff(trace.t))),
        "clearance_min_m": float(np.min(trace.propeller_clearance[after])),
    }


def _rate(values: np.ndarray, t: np.ndarray) -> np.ndarray:
    return np.gradient(values, t) if len(t) > 1 else np.zeros(1)


#: Figures of the rotors.
_EFFORT = ("effort_n", "jitter_n_s")


def paint_figures(trace: Trace) -> dict[str, float]:
    """Every number of M, without those that depend on the computer."""
    return _numbers(trace, *(name for name, figure in FIGURES.items() if not figure.timing))


def paint_timed_figures(trace: Trace) -> dict[str, float]:
    """Figures of a paint job with a timing of the machine, the rate of perception."""
    return paint_figures(trace) | _numbers(trace, "perception_hz")


def effort_figures(trace: Trace) -> dict[str, float]:
    """Thrust effort and thrust rate over the flight after its first second."""
    return _numbers(trace, *_EFFORT)


def _numbers(trace: Trace, *names: str) -> dict[str, float]:
    """The named figures as far as they are numbers."""
    part = Part.whole(trace)
    found = {name: of(part) for name in names if (of := FIGURES[name].of) is not None}
    return {name: float(value) for name, value in found.items() if type(value) in (int, float)}
