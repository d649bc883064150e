"""A made-up press: the tip touches at a known time, overshoots, bounces and settles as told."""

from __future__ import annotations

import numpy as np

from sim.experiments.scenes import near_wall
from sim.flight.trace import Event, Trace
from sim.world.board import BoardGeometry
from sim.world.scene import Scene

TICK_S, TOUCH_S, END_S = 0.004, 2.0, 12.0
PHASES = ("approach", "press", "paint", "retreat")


def press_trace(
    *,
    settle_s: float = 1.2,
    bias_n: float = 0.1,
    bounces: int = 0,
    peak_n: float = 5.5,
    drop_m: float = 0.0,
    roll_deg: float = 0.0,
    scene: Scene | None = None,
    fault_s: float | None = None,
    back_s: float = 1.0,
) -> Trace:
    """Push of 1 N until ``settle_s``, then reference + bias; after a fault it is 2 N off for ``back_s``."""
    scene = scene or near_wall()
    t = np.arange(round(END_S / TICK_S)) * TICK_S
    clock = np.arange(4 * len(t)) * 1e-3
    push = scene.paint.push_n
    since = clock - TOUCH_S
    contact = np.where(since < 0.0, 0.0, np.where(since < settle_s, 1.0, push + bias_n))
    contact[(since >= 0.3) & (since < 0.31)] = peak_n
    for bounce in range(bounces):
        contact[(since >= 0.05 * (bounce + 1)) & (since < 0.05 * (bounce + 1) + 0.004)] = 0.0
    events = []
    if fault_s is not None:
        contact[(clock >= fault_s) & (clock < fault_s + back_s)] += 2.0
        events.append(Event(t=fault_s, kind="fault", text="made up"))
    reference = np.where(t >= TOUCH_S, push, 0.0)
    height = np.where(t > TOUCH_S, -drop_m, 0.0)
    place = BoardGeometry(scene).point(np.full(len(t), 1.0), scene.paint.edge_margin_m + height)
    tip = np.column_stack((np.minimum(0.02 * (t - TOUCH_S), 0.0), place))
    half = np.radians(roll_deg) / 2.0
    count = len(t)
    arrays = {
        "t": t,
        "tip": tip,
        "position": tip - [0.7, 0.0, 0.0],
        "attitude": np.tile([np.cos(half), np.sin(half), 0.0, 0.0], (count, 1)),
        "euler": np.tile([np.radians(roll_deg), 0.0, 0.0], (count, 1)),
        "push_true": contact[3::4],
        "push_measured": contact[3::4],
        "push_reference": reference,
        "line_error_px": np.zeros((count, 2)),
        "contact_1khz": contact,
        "phase": np.where(t < 1.0, 0, 1),
        "row": np.zeros(count, int),
        "active": np.zeros((count, 1), bool),
        "thrusts_actual": np.full((count, 6), 11.33),
        "true_mass": np.array([6.0]),
        "true_thrust_min": np.full(6, 1.2),
        "true_thrust_max": np.full(6, 52.56),
    }
    return Trace(scene=scene, seed=0, law="qp", arrays=arrays, phases=PHASES, events=events, claimed=True)
