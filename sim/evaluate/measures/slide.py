"""Figures of a slide along the edge under push: yaw, speed, height and force while friction pulls at the tip."""

from __future__ import annotations

import math

import numpy as np

from sim.evaluate.measures.press import press_figures, push_figures
from sim.evaluate.window import (
    CONTACT_N,
    attitude_figures,
    board_tip,
    limited_fraction,
    mean,
    peak,
    phase_window,
    rms,
)
from sim.flight.trace import Trace

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
