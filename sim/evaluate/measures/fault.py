"""Figures of a flight with a fault: motion and commands of the vehicle, and times of the supervisor."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.command import SafetyState
from ibvs_qp.config.vehicle import VehicleParams
from sim.evaluate.window import CONTACT_N, contact_clock, event_time, peak, tilt_deg
from sim.flight.trace import CRASH, LANDED, Trace

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
