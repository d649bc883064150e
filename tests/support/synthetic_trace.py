"""A made-up flight with known errors, so that metrics can be checked exactly and reports drawn without flying."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.frames import rotation_from_quaternion
from sim.evaluate.paint_plan import band_mask, nominal_plan
from sim.flight.trace import Event, Trace
from sim.world.board import BoardGeometry
from sim.world.scene import Scene

PHASES = ("start", "approach", "align", "press", "paint", "climb", "retreat", "done")
OUTCOMES = ("solved", "inaccurate_accepted", "capped_accepted", "exact_fallback", "analytic_fallback", "hold")
LIMITS = ("thrust_min:front_left", "thrust_max:front_left", "level_roll")
TICK_S, PHYSICS_PER_TICK = 0.004, 4
TOUCH_S, RAMP_S, PAINT_FROM_S = 4.0, 1.0, 6.0


@dataclass(frozen=True, kw_only=True)
class Errors:
    """What is wrong with the flight, and by how much."""

    row_offset_m: tuple[float, ...] = (0.002, 0.003)  # tip beyond its row, the row before being right
    longer_m: float = 0.0  # odd rows end too late
    push_error_n: float = 0.2
    roll_deg: float = 0.5
    yaw_deg: float = -1.5
    peak_n: float = 6.5
    lost_steps: int = 0
    bounces: int = 2
    velocity_bias_m_s: tuple[float, float, float] = (0.003, 0.004, 0.0)
    noise: float = 0.0
    unpainted_share: float = 0.0


def _waypoints(scene: Scene, errors: Errors) -> list[tuple[float, str, int, np.ndarray]]:
    """(time at the end, phase, row, board coordinates at the end), rows offset as the errors say."""
    paint, board = scene.paint, BoardGeometry(scene)
    begin, end = board.stroke_ends
    across = board.stroke_place(1) + errors.row_offset_m[0]
    time = PAINT_FROM_S
    points = [(time, "press", 0, np.array([begin, across]))]
    for row in range(1, board.strokes + 1):
        if row > 1:
            across += board.stroke_place(row) - board.stroke_place(row - 1) + errors.row_offset_m[row - 1]
            time += (across - points[-1][3][1]) / paint.speed_m_s
            points.append((time, "climb", row, np.array([points[-1][3][0], across])))
        stop = end + errors.longer_m if row % 2 else begin
        time += abs(stop - points[-1][3][0]) / paint.speed_m_s
        points.append((time, "paint", row, np.array([stop, across])))
    return [(time, phase, row, board.from_pattern(place)) for time, phase, row, place in points]


def synthetic_trace(
    errors: Errors | None = None, scene: Scene | None = None, law: str = "qp", seed: int = 0, pictures: int = 12
) -> Trace:
    """Make one flight; every array of `sim.flight.trace.FIELDS` is filled."""
    errors, scene = errors or Errors(), scene or Scene()
    rng = np.random.default_rng(seed)
    board, points = BoardGeometry(scene), _waypoints(scene, errors)
    end = points[-1][0] + 3.0
    t = np.arange(round(end / TICK_S)) * TICK_S
    count = len(t)
    times = np.array([0.0, *(point[0] for point in points)])
    path = np.array([points[0][3], *(point[3] for point in points)])
    tip_board = np.column_stack([np.interp(t, times, path[:, axis]) for axis in (0, 1)])
    stage = np.searchsorted(times[1:], t + 1e-9)
    names = [point[1] for point in points] + ["retreat"]
    phase_names = np.array(names, dtype="U16")[stage]
    phase_names[t < 3.0] = "align"
    phase_names[t < 2.0] = "approach"
    rows = np.array([point[2] for point in points] + [0])[stage]
    painting = np.isin(phase_names, ("paint", "climb"))
    demanded = (t >= TOUCH_S) & (t < points[-1][0])
    reference = scene.paint.push_n * np.clip((t - TOUCH_S) / RAMP_S, 0.0, 1.0) * demanded
    push = np.where(demanded, reference + errors.push_error_n * painting, 0.0)
    push[(t >= TOUCH_S) & (t < TOUCH_S + RAMP_S)] += 0.2
    contact = np.repeat(push, PHYSICS_PER_TICK)
    touch = int(np.argmax(contact > 0))
    contact[touch + 20] = errors.peak_n
    for bounce in range(errors.bounces):
        contact[touch + 100 * (bounce + 1) : touch + 100 * (bounce + 1) + 5] = 0.0
    painting_1khz = np.repeat(painting, PHYSICS_PER_TICK)
    lost = np.flatnonzero(painting_1khz)[4000 : 4000 + errors.lost_steps]
    contact[lost] = 0.0
    standoff = np.interp(t, [0, 2, 3, TOUCH_S], [scene.start.distance_m, 0.02, 0.02, 0.0])
    standoff[t > points[-1][0]] = (t[t > points[-1][0]] - points[-1][0]) * 0.1  # 0.3 m at the end
    tip = np.column_stack((-standoff, board.point(*tip_board.T)))
    half_roll, half_yaw = np.radians(errors.roll_deg) / 2, np.radians(errors.yaw_deg) / 2
    attitude = np.array(  # yaw, then roll
        [
            np.cos(half_roll) * np.cos(half_yaw),
            np.sin(half_roll) * np.cos(half_yaw),
            np.sin(half_roll) * np.sin(half_yaw),
            np.cos(half_roll) * np.sin(half_yaw),
        ]
    )
    velocity = np.gradient(tip, t, axis=0)
    estimate = velocity + np.array(errors.velocity_bias_m_s) + errors.noise * rng.normal(size=velocity.shape)
    estimate[: round(0.5 / TICK_S)] = np.nan
    thrusts = 11.3 + 1.5 * np.sin(0.3 * t[:, None] + np.arange(6)) + errors.noise * rng.normal(size=(count, 6))
    active = np.zeros((count, len(LIMITS)), bool)
    active[: count // 4, 0] = True
    line = 3.0 * np.column_stack((np.sin(0.7 * t), np.cos(0.5 * t))) * np.exp(-t / 8)[:, None]
    line[rows != 1, 1] = np.nan
    arrays = {
        "t": t,
        "position": tip - rotation_from_quaternion(attitude) @ (0.7, 0.0, 0.0),
        "velocity": velocity,
        "attitude": np.tile(attitude, (count, 1)),
        "euler": np.tile(np.radians([errors.roll_deg, 0.0, errors.yaw_deg]), (count, 1)),
        "tip": tip,
        "thrusts": thrusts,
        "thrusts_actual": thrusts,
        "thrust_min": np.full(6, 1.2),
        "thrust_max": np.full(6, 52.56),
        "true_thrust_min": np.full(6, 1.2),
        "true_thrust_max": np.full(6, 52.56),
        "true_mass": np.array([6.0]),
        "push_true": push,
        "push_measured": push + 0.05 * rng.normal(size=count),
        "push_reference": reference,
        "friction_true": np.column_stack((-0.3 * push, np.zeros(count))),
        "velocity_estimate": estimate,
        "standoff_estimate": standoff,
        "line_error_px": line,
        "contact_weight": np.clip((t - TOUCH_S) / RAMP_S, 0.0, 1.0) * demanded,
        "phase": np.array([PHASES.index(name) for name in phase_names]),
        "row": rows,
        "outcome": np.zeros(count, int),
        "active": active,
        "unallocated": np.zeros((count, 6)),
        "step_us": np.linspace(30.0, 60.0, count),
        "iterations": np.full(count, 25),
        "vision_ms": np.linspace(1.0, 2.0, count // 8),
        "propeller_clearance": 0.09 + standoff,
        "contact_1khz": contact,
        "painting_1khz": painting_1khz,
    }
    px_per_m = 200.0
    shape = (round(scene.board.height_m * px_per_m), round(scene.board.width_m * px_per_m))
    mask = band_mask(scene, nominal_plan(scene), shape, px_per_m).astype(np.float32)
    covered = np.flatnonzero(mask)
    mask.flat[covered[: round(errors.unpainted_share * len(covered))]] = 0.0
    canvas = np.where(mask[..., None] > 0.5, scene.paint.color, scene.board.color).astype(np.uint8)
    changes = np.flatnonzero(np.diff(arrays["phase"])) + 1
    events = [Event(t=float(t[i]), kind=str(phase_names[i]), text=f"{phase_names[i]}: made up") for i in changes]
    return Trace(
        scene=scene,
        seed=seed,
        law=law,
        arrays=arrays,
        phases=PHASES,
        outcomes=OUTCOMES,
        limits=LIMITS,
        events=[*events, Event(t=TOUCH_S, kind="touch", text="touch at 0.05 m/s")],
        claimed=True,
        reason="rows, climbs and retreat done",
        wall_time_s=end / 8.0,
        canvas=canvas,
        canvas_px_per_m=px_per_m,
        coverage_mask=mask,
        pictures=[
            (float(time), np.tile(rng.integers(0, 255, (1, 160, 3), dtype=np.uint8), (120, 1, 1)), "paint")
            for time in np.linspace(0, end, pictures)
        ],
    )
