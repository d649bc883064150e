"""Checks of a job before its flight: conflicts of board, strokes, brush, camera, sensors and colours.

Every limit follows from a setting or from geometry; a truth of the plant, such as a wrong mass, is never refused here,
except for motors that are much slower than the vehicle's.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator

import numpy as np

from allocation import WrenchFacets, worst_level_reach
from ibvs_qp.config import ControllerConfig, SafetySettings
from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.frames import GRAVITY, rotation_from_quaternion, to_camera
from ibvs_qp.model.motion_margin import LARGEST_SENSITIVITY, motion_sensitivity
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.painting.pattern import PLACE_TOLERANCE_M, ROWS, Pattern
from sim.flight.jobs import Job, PaintJob
from sim.world.board import BoardGeometry
from sim.world.clearance import PropellerClearance
from sim.world.crash import GROUND_CLEARANCE_M
from sim.world.mjcf import STEP_NS
from sim.world.scene import ImuScene, Scene
from sim.world.trim import START_DISTANCE_M, START_DOWN_M, START_RIGHT_M, START_YAW_DEG, facing

#: Spacing of the points at which a line is tested [m]: a pixel is 0.8 mm at 640x480 and 0.5 m.
STEP_M = 0.001


class ContactView:
    """The picture of the wall plane around the tip, in pattern coordinates relative to it.

    Args:
        pattern: Directions of the strokes.
        config: The nominal vehicle of the controller, its bounds of the view, and the shortest line.
        brush_width_m: Diameter of the brush, which hides the wall [m].
    """

    def __init__(self, pattern: Pattern, config: PilotConfig, brush_width_m: float) -> None:
        vehicle, limits = config.controller.vehicle, config.controller.limits
        tip = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))
        depth = max(float(tip[2]), 0.0)
        bounds = np.array(((limits.view_left, limits.view_up), (limits.view_right, limits.view_down)))
        self._low, self._high = bounds * depth - tip[:2]
        self._axes, self._radius = np.array((pattern.along, pattern.across)), 0.5 * brush_width_m
        width = vehicle.camera_size_px[0] / vehicle.camera_intrinsics_px[0]
        self._least = config.vision.detect.min_length * width * depth
        self._reach = 2.0 * float(np.abs(bounds).max()) * depth

    def shows_parallel(self, aside: float, behind: float, ahead: float) -> bool:
        """Whether a line along the strokes has a piece in view that is long enough to be found.

        Args:
            aside: Its v relative to the tip's [m].
            behind: Its least u relative to the tip's [m].
            ahead: Its greatest u [m].
        """
        along = self._between(behind, ahead)
        return self._longest(np.column_stack((along, np.full(len(along), aside)))) >= self._least

    def shows_across(self, ahead: float, low: float, high: float) -> bool:
        """The same of a line across the strokes.

        Args:
            ahead: Its u relative to the tip's [m].
            low: Its least v relative to the tip's [m].
            high: Its greatest v [m].
        """
        across = self._between(low, high)
        return self._longest(np.column_stack((np.full(len(across), ahead), across))) >= self._least

    def _between(self, low: float, high: float) -> np.ndarray:
        return np.arange(max(low, -self._reach), min(high, self._reach), STEP_M)

    def _longest(self, uv: np.ndarray) -> float:
        """Length of the longest run of points in view [m]."""
        places = uv @ self._axes  # (right, down)
        inside = ((places >= self._low) & (places <= self._high)).all(axis=1)
        seen = np.concatenate(([0], (inside & (np.hypot(*uv.T) > self._radius)).astype(int), [0]))
        edges = np.flatnonzero(np.diff(seen))
        return STEP_M * float(max((edges[1::2] - edges[::2]), default=0))


#: Neighbouring strokes come locally up to 7 mm farther apart than nominal (14 pairs of strokes of 0.6 and 0.8 m in the
#: world datasheet, from the sensor model of lines); this much overlap leaves a little of it [m].
LEAST_OVERLAP_M = 0.008
#: Lengths and times are compared to this [m, s]: rounding of sums of settings.
ROUNDING = 1e-9
#: Gusts that a job must stand, in standard deviations: stronger ones blow a twentieth of the time.
GUST_DEVIATIONS = 2.0
#: Acceleration to the side that is left against wind [m/s^2]; assumed: a drawn scene with less struck the wall.
CONTROL_RESERVE_M_S2 = 0.5

#: Mean lag of the plant's motors over the vehicle's, at most [-]: the QP completes at 1.9 (2 seeds of the world
#: datasheet), a monitor ends 1 of 2 flights at 2.3, and it crashes at 2.6.
LARGEST_LAG_RATIO = 2.0
#: Noise of the IMU per sample, at most: accelerometer [m/s^2], gyro [rad/s], attitude [deg]. Between the
#: values of completed flights, 0.95, 0.095 and 0.4 (2 seeds each in the world datasheet), and of failed ones: 1.9, 0.19
#: and 0.8, under both laws.
MOST_ACCEL_NOISE, MOST_GYRO_NOISE, MOST_ATTITUDE_NOISE_DEG = 1.2, 0.12, 0.5
#: Largest variation of the start's tip by the seed, in the chart [m].
START_M = START_DISTANCE_M, START_RIGHT_M, START_DOWN_M
#: Distances of a start that are tried before a curved wall: first, last of a scene, step [m].
DISTANCES_M = 0.15, 2.0, 0.01
#: Time of a job in gusts over that of its strokes alone [-]: most of them are painted again in the harsh world.
AGAIN = 2.0


def check_job(scene: Scene, config: PilotConfig, features: str = "rendered", job: Job | None = None) -> None:
    """Refuse a job that cannot be flown, before anything is shown or written.

    Args:
        scene: Board, paint job, start and sensors.
        config: The pilot with the scene's paint job, see `sim.flight.options.pilot_config`.
        features: "rendered" or "geometric"; lines without pictures have no colours.
        job: Task at the wall; None paints.

    Raises:
        ConfigError: Naming keys, values, units and the allowed ranges of everything that is wrong, in one line.
    """
    if problems := job_problems(scene, config, features, job):
        raise ConfigError("; ".join(problems))


def job_problems(scene: Scene, config: PilotConfig, features: str = "rendered", job: Job | None = None) -> list[str]:
    """Conflicts that forbid a flight, one sentence each; arguments as of `check_job`. Empty: it can be flown."""
    problems = [*_sensors(scene, config), *_wind(scene, config), *_motors(scene, config), *_period(config)]
    if features == "rendered":
        problems += _colours(scene, config)
    if not isinstance(job or PaintJob(), PaintJob):
        return problems if BoardGeometry(scene).surface.flat else [*problems, *_start(BoardGeometry(scene), config)]
    overlap = list(_overlap(scene))
    if overlap:  # without a distance between strokes none of them has a place
        return problems + overlap
    board = BoardGeometry(scene)
    off = list(_strokes(board))
    if off:
        return problems + off
    return [*problems, *_start(board, config), *_views(board, config), *_envelope(board, config)]


#: Another key with its value and unit.
Key = tuple[str, float, str]


def _problem(field: str, value: object, unit: str, allowed: str, reason: str, *keys: Key) -> str:
    beside = ", ".join(f"{name} = {number:g} {name_unit}".rstrip() for name, number, name_unit in keys)
    return str(out_of_range(field, value, unit, f"{allowed}: {reason}" + (f" ({beside})" if keys else "")))


def _overlap(scene: Scene) -> Iterator[str]:
    """Neighbouring strokes touch, and lie farther apart than the tolerance of a place: else one would count as both."""
    paint = scene.paint
    most = paint.brush_width_m - PLACE_TOLERANCE_M
    if paint.rows != 1 and not LEAST_OVERLAP_M - ROUNDING <= paint.overlap_m <= most + ROUNDING:
        allowed = (
            f"allowed is [{LEAST_OVERLAP_M:g}, {most:.4g}] m" if most >= LEAST_OVERLAP_M else "allowed is no value"
        )
        reason = f"neighbouring strokes touch, and lie at least {PLACE_TOLERANCE_M:g} m apart"
        brush = "paint.brush_width_m", paint.brush_width_m, "m"
        yield _problem("paint.overlap_m", paint.overlap_m, "m", allowed, reason, brush)


def _strokes(board: BoardGeometry) -> Iterator[str]:
    """Strokes keep the margin at both ends, where edges stop them, and the brush's centre stays on the board."""
    paint, (length, extent) = board.scene.paint, board.extent
    sides = ("board.width_m", "board.height_m")
    along, across = sides if board.pattern.kind == ROWS else sides[::-1]
    reason = "the brush's centre stays on the board in every stroke that is at its place"
    margin: Key = ("paint.edge_margin_m", paint.edge_margin_m, "m")
    longest, widest = length - 2.0 * paint.edge_margin_m, extent - PLACE_TOLERANCE_M
    if paint.stroke_m > longest + ROUNDING:
        allowed, words = f"allowed is at most {max(longest, 0.0):.4g} m", "strokes keep the margin at both ends"
        yield _problem("paint.stroke_m", paint.stroke_m, "m", allowed, words, (along, length, "m"), margin)
    if paint.edge_margin_m > widest + ROUNDING:
        allowed = f"allowed is at most {max(widest, 0.0):.4g} m"
        yield _problem(*margin, allowed, reason, (across, extent, "m"))
    elif board.stroke_place(board.strokes) > widest + ROUNDING:
        allowed = f"allowed is at most {1 + math.floor((widest - paint.edge_margin_m) / paint.pitch_m + ROUNDING)}"
        keys = (across, extent, "m"), margin, ("distance of strokes", paint.pitch_m, "m")
        yield _problem("paint.rows", paint.rows, "", allowed, reason, *keys)


def _start(board: BoardGeometry, config: PilotConfig) -> Iterator[str]:
    """At the start nothing touches ground, board or wall, for any seed."""
    start, vehicle = board.scene.start, config.controller.vehicle
    sunk = float(board.start_tip[2]) - vehicle.tip_position_m[2] + START_DOWN_M + GROUND_CLEARANCE_M
    if sunk > 0.0:
        allowed, reason = f"allowed is at most {start.down_m - sunk:.3g} m", "the vehicle starts above the ground"
        bottom = "board.bottom_m", board.scene.board.bottom_m, "m"
        yield _problem("start.down_m", start.down_m, "m", allowed, reason, bottom)
    clearance = PropellerClearance(board, vehicle)
    near = -_start_clearance(board, config, clearance, start.distance_m)
    if near >= 0.0:
        allowed, reason = f"allowed is at least {start.distance_m + near:.3g} m", "no propeller starts at the wall"
        if not board.surface.flat:
            ways = np.arange(*DISTANCES_M).tolist()
            clear = [way for way in ways if _start_clearance(board, config, clearance, way) > 0.0]
            allowed = f"allowed is [{clear[0]:.3g}, {clear[-1]:.3g}] m" if clear else "allowed is no value"
        yaw = "start.yaw_deg", start.yaw_deg, "deg"
        yield _problem("start.distance_m", start.distance_m, "m", allowed, reason, yaw)


def _start_clearance(board: BoardGeometry, config: PilotConfig, clearance: PropellerClearance, way: float) -> float:
    """Least distance of a propeller to board or wall at a start so far away, for any seed [m]."""
    nearest, varied = board.scene.start.distance_m - way, itertools.product((-1.0, 1.0), repeat=3)
    shifts = {(1.0, 0.0, 0.0)} if board.surface.flat else varied  # a flat wall is nearest for the nearest tip
    poses = (
        facing(board, config.controller.vehicle, np.add((nearest, 0.0, 0.0), np.multiply(shift, START_M)), turn)
        for shift in shifts
        for turn in (-START_YAW_DEG, START_YAW_DEG)
    )
    return min(clearance.distance(place, rotation_from_quaternion(attitude)) for place, attitude in poses)


def _views(board: BoardGeometry, config: PilotConfig) -> Iterator[str]:
    """In contact the camera shows the board's edges where stroke 1 begins and ends, and a guide of later strokes."""
    paint, camera = board.scene.paint, board.scene.camera
    field_of_view = "camera.vertical_fov_deg", camera.vertical_fov_deg, "deg"
    if not _shows_edges(board, config, paint.edge_margin_m):
        shown = [margin for margin in np.arange(0.0, 1.0, STEP_M).tolist() if _shows_edges(board, config, margin)]
        allowed = f"allowed is [{shown[0]:.3g}, {shown[-1]:.3g}] m" if shown else "allowed is no value"
        reason = "in contact the board's edges beside stroke 1 and at its end are in view"
        yield _problem("paint.edge_margin_m", paint.edge_margin_m, "m", allowed, reason, field_of_view)
    if not _shows_guides(board, config, paint.brush_width_m):
        widths = np.arange(paint.brush_width_m, paint.overlap_m + PLACE_TOLERANCE_M, -STEP_M).tolist()
        shown = [width for width in widths if _shows_guides(board, config, width)]
        allowed = f"allowed is at most {shown[0]:.3g} m" if shown else "allowed is no value"
        reason = "in contact the edge of the stroke before is in view ahead of the brush"
        yield _problem("paint.brush_width_m", paint.brush_width_m, "m", allowed, reason, field_of_view)


def _shows_edges(board: BoardGeometry, config: PilotConfig, margin: float) -> bool:
    """Whether with a margin the guiding edge is in view where stroke 1 begins, and the stopping edge where it ends."""
    guiding = ContactView(board.pattern, config, board.scene.paint.brush_width_m)
    stopping = ContactView(board.pattern, config, 0.0)  # it is followed before the brush comes near
    across = board.extent[1]
    return _shows_guiding_edge(board, guiding, margin) and stopping.shows_across(margin, -margin, across - margin)


def _shows_guiding_edge(board: BoardGeometry, view: ContactView, aside: float) -> bool:
    """Whether the guiding edge of the board is in view, so far from the tip [m], where stroke 1 begins."""
    begin = board.stroke_ends[0]
    return view.shows_parallel(-aside, -begin, board.extent[0] - begin)


def _shows_guides(board: BoardGeometry, config: PilotConfig, brush: float) -> bool:
    """Whether ahead of every later stroke the edge of the stroke before is in view, or still the board's.

    ``brush`` is the width of the brush [m].
    """
    view, paint = ContactView(board.pattern, config, brush), board.scene.paint
    ways = [board.pattern.travel(stroke) for stroke in range(2, min(board.strokes, 3) + 1)]
    reach = [sorted((0.0, way * paint.stroke_m)) for way in ways]
    fresh = all([view.shows_parallel(paint.overlap_m - 0.5 * brush, *ends) for ends in reach])
    return fresh or _shows_guiding_edge(board, view, board.stroke_place(board.strokes))


def _envelope(board: BoardGeometry, config: PilotConfig) -> Iterator[str]:
    """The job ends within the supervisor's bounds of time and height."""
    safety, paint = config.safety, board.scene.paint
    if not safety.supervise:
        return
    seconds, most = PaintJob().expected_s(config.painting, board.strokes), safety.mission_s / AGAIN
    if seconds > most:
        allowed = f"allowed is at least {paint.speed_m_s * seconds / most:.3g} m/s"
        mission = "safety.mission_s", safety.mission_s, "s"
        reason = f"the strokes take {seconds:.0f} s, and {AGAIN:g} times as long where they are painted again"
        yield _problem("paint.speed_m_s", paint.speed_m_s, "m/s", allowed, reason, mission)
    corners = [(u, board.stroke_place(stroke)) for u in board.stroke_ends for stroke in (1, board.strokes)]
    heights = board.point(*board.from_pattern(np.array(corners)).T)[:, 1]
    change = float(np.ptp(heights))
    if change > safety.height_m:
        key = ("paint.rows", paint.rows, "") if board.pattern.kind == ROWS else ("paint.stroke_m", paint.stroke_m, "m")
        bound = "safety.height_m", safety.height_m, "m"
        allowed = f"allowed is a change of height of at most {safety.height_m:g} m"
        reason = f"the strokes reach over {change:.3g} m"
        yield _problem(*key, allowed, reason, bound)


def _sensors(scene: Scene, config: PilotConfig) -> Iterator[str]:
    """Samples come at the rate of the contract and are never older than the pilot and its supervisor allow."""
    camera, force, safety, tick = scene.camera, scene.force_torque, config.safety, config.controller.tick_s
    if scene.imu.rate_hz * tick < 1.0 - ROUNDING:
        allowed, reason = f"allowed is at least {1.0 / tick:g} Hz", "attitude and IMU are sampled once a tick"
        yield _problem("imu.rate_hz", scene.imu.rate_hz, "Hz", allowed, reason, ("controller.tick_s", tick, "s"))
    yield from _noise(scene.imu)
    # Jitter of delivery is exponential: its mean, and as much again for its standard deviation.
    late = camera.latency_s + 2.0 * scene.errors.timing.jitter_s + abs(scene.errors.timing.stamp_error_s)
    old = list(_age("camera", camera.rate_hz, camera.latency_s, late, tick, *_oldest_picture(safety)))
    if safety.supervise and old:
        yield from old
    elif late > config.camera.latest_s:
        allowed = f"allowed is at most {camera.latency_s - late + config.camera.latest_s:.3g} s"
        latest = "camera.latest_s", config.camera.latest_s, "s"
        reason = "a picture that comes later is refused"
        yield _problem("camera.latency_s", camera.latency_s, "s", allowed, reason, latest)
    if safety.supervise:
        delay = force.latency_s
        yield from _age("force_torque", force.rate_hz, delay, delay, tick, "safety.wrench_age_s", safety.wrench_age_s)


def _noise(imu: ImuScene) -> Iterator[str]:
    """Noise with which odometer or attitude fail."""
    root, rate = math.sqrt(imu.rate_hz), ("imu.rate_hz", imu.rate_hz, "Hz")
    for field, value, unit, most, keys in (
        ("imu.accel_density", imu.accel_density, "m/s^2/sqrt(Hz)", MOST_ACCEL_NOISE / root, (rate,)),
        ("imu.gyro_density", imu.gyro_density, "rad/s/sqrt(Hz)", MOST_GYRO_NOISE / root, (rate,)),
        ("imu.attitude_noise_deg", imu.attitude_noise_deg, "deg", MOST_ATTITUDE_NOISE_DEG, ()),
    ):
        if value > most + ROUNDING:
            reason = "stronger noise disturbs odometer and attitude"
            yield _problem(field, value, unit, f"allowed is at most {most:.3g} {unit}", reason, *keys)


def _oldest_picture(safety: SafetySettings) -> tuple[str, float]:
    ages = {"safety.image_age_s": safety.image_age_s, "safety.plane_age_s": safety.plane_age_s}
    return min(ages.items(), key=lambda item: item[1])


def _age(section: str, rate: float, latency: float, late: float, tick: float, limit: str, most: float) -> Iterator[str]:
    """Refuse samples that get older than a limit, at a rate [Hz], a latency, its worst and a tick [s]."""
    age = oldest_s(rate, late, tick)
    if age > most + ROUNDING:
        ticks = math.floor((most - oldest_s(rate, 0.0, tick)) / tick + ROUNDING)
        latest = ticks * tick - (late - latency)
        allowed = f"allowed is at most {latest:.3g} s" if latest >= 0.0 else "allowed is no value"
        keys = (f"{section}.rate_hz", rate, "Hz"), (limit, most, "s")
        reason = f"a sample gets {age:.3g} s old"
        yield _problem(f"{section}.latency_s", latency, "s", allowed, reason, *keys)


def oldest_s(rate_hz: float, delay_s: float, tick_s: float) -> float:
    """Age of a sample at the last tick before the next one arrives [s]; samples are taken and delivered at ticks."""
    delay, period = (math.ceil(value / tick_s - ROUNDING) for value in (delay_s, 1.0 / rate_hz))
    return (delay + period - 1) * tick_s


def _wind(scene: Scene, config: PilotConfig) -> Iterator[str]:
    """The rotors of a level vehicle hold against the mean wind and usual gusts in the least favourable direction.

    Wind along the vertical adds to the weight or takes from it; both leave less to the side.
    """
    vehicle, wind = config.controller.vehicle, scene.wind
    carried = vehicle.mass_kg * GRAVITY + vehicle.linear_drag_n_s_m * wind.mean_m_s[2]
    held, _ = worst_level_reach(WrenchFacets(vehicle.geometry), carried, vehicle.thrust_min, vehicle.thrust_max)
    held -= vehicle.mass_kg * CONTROL_RESERVE_M_S2
    mean = vehicle.linear_drag_n_s_m * math.hypot(*wind.mean_m_s[:2])
    gusts = GUST_DEVIATIONS * wind.gust_n_rms
    if mean + gusts > held:
        reason = f"{mean:.3g} N of mean wind and gusts of {gusts:.3g} N are held level up to {held:.3g} N"
        strength = "wind.gust_n_rms", wind.gust_n_rms, "N"
        if mean > gusts:
            allowed = (
                f"allowed is a level speed of at most {max(held - gusts, 0.0) / vehicle.linear_drag_n_s_m:.3g} m/s"
            )
            yield _problem("wind.mean_m_s", list(wind.mean_m_s), "m/s", allowed, reason, strength)
        else:
            yield _problem(*strength, f"allowed is at most {(held - mean) / GUST_DEVIATIONS:.3g} N", reason)


def _period(config: PilotConfig) -> Iterator[str]:
    """A period longer than the default leaves the loops of the body their margin."""

    def peak(tick_s: float) -> float:
        return max(motion_sensitivity(dataclasses.replace(config.controller, tick_s=tick_s)).values())

    tick = config.controller.tick_s
    if tick > ControllerConfig().tick_s and (found := peak(tick)) > LARGEST_SENSITIVITY:
        shorter = [steps * 1e-9 * STEP_NS for steps in range(round(tick * 1e9 / STEP_NS) - 1, 0, -1)]
        good = next((each for each in shorter if peak(each) <= LARGEST_SENSITIVITY), None)
        if good is not None:
            reason = f"the largest sensitivity of a loop is {found:.2f}, allowed is {LARGEST_SENSITIVITY:g}"
            yield _problem("controller.tick_s", tick, "s", f"allowed is at most {good:g} s", reason)


def _motors(scene: Scene, config: PilotConfig) -> Iterator[str]:
    """Motors of the plant that lag much longer than those of the vehicle."""
    plant, vehicle = scene.plant, config.controller.vehicle
    expected = vehicle.motor_lag_s
    up = vehicle.motor_lag_up_s if plant.motor_lag_up_s is None else plant.motor_lag_up_s
    down = vehicle.motor_lag_down_s if plant.motor_lag_down_s is None else plant.motor_lag_down_s
    if up + down > 2.0 * LARGEST_LAG_RATIO * expected:
        allowed = f"allowed is at most {LARGEST_LAG_RATIO * expected:g} s on average"
        reason = f"estimators, observers and leads count on the vehicle's {expected:g} s"
        pair = ("plant.motor_lag_up_s", up, "s"), ("plant.motor_lag_down_s", down, "s")
        (field, value, unit), other = sorted(pair, key=lambda lag: -lag[1])
        yield _problem(field, value, unit, allowed, reason, other)


def _colours(scene: Scene, config: PilotConfig) -> Iterator[str]:
    """Board, wall and paint differ in colour, at any gap between board and wall."""
    gate = config.vision.line.color_gate
    colors = {"board": scene.board.color, "wall": scene.wall.color, "paint": scene.paint.color}
    for one, other in (("paint", "board"), ("wall", "board"), ("wall", "paint")):
        apart = math.dist(colors[one], colors[other])
        if apart < gate:
            allowed = (
                f"allowed is a distance of at least {gate:g} grey levels from {other}.color = {list(colors[other])}"
            )
            reason = f"vision separates them by colour, and theirs differ by {apart:.0f} (vision.line.color_gate)"
            yield _problem(f"{one}.color", list(colors[one]), "", allowed, reason)
