"""Motion in the wall plane: velocity, odometer and lines in metres, predicted every tick and corrected by pictures."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from ibvs_qp.config import EstimationConfig
from ibvs_qp.estimation.kalman import LateKalman
from ibvs_qp.estimation.line_tracking import LINES, SLOTS, LineInput, LineRecords, correct_line
from ibvs_qp.estimation.tick_history import TickHistory
from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.estimation.wall_lines import WallAxes, image_line, wall_line
from ibvs_qp.frames import GRAVITY
from ibvs_qp.measurement import VERTICAL, FeatureFrame, LineFeature
from ibvs_qp.symbolic.function import StepFunction
from ibvs_qp.symbolic.logic import both, no, where
from ibvs_qp.symbolic.signals import Signals

#: Order of the state, each (right, down): velocity [m/s], accelerometer bias [m/s^2], odometer [m]; then the offset of
#: every line [m] (`LINES`).
VELOCITY, BIAS, ODOMETER, STATES = slice(0, 2), slice(2, 4), slice(4, 6), LINES + SLOTS
#: Spectral density of the odometer itself [m^2/s]: nearly none.
ODOMETER_NOISE = 1e-10
#: Standard deviations at the start: velocity [m/s], bias [m/s^2], odometer [m], unused line [m].
VELOCITY_STD, BIAS_STD, ODOMETER_STD, UNUSED_STD = 0.05, 0.1, 1e-6, 0.05
#: Standard deviations after refused velocities: of the velocity [m/s], and of the bias that made it wrong [m/s^2]: 3
#: degrees of attitude.
RESTART_VELOCITY_STD, RESTART_BIAS_STD = 0.03, 0.5
#: Lines alone give the velocity where its standard deviation is below this [m/s], a fifth of a usual painting speed. A
#: plain board's corner has no points for the flow, but its two edges fix both components.
KNOWN_STD = 0.02
#: Without ticks for this long [ns], the velocity has this standard deviation [m/s].
GAP_NS, GAP_VELOCITY_STD = 100_000_000, 0.5
#: Least variance of a reported line offset [m^2].
LEAST_VARIANCE = 1e-10
#: Inputs of a correction, in the order of packing: time since the last one [s]; noise of the specific force
#: [m^2/s^3]; whether the velocity is in doubt; state at the capture, and its age [s]; axes of the wall then and
#: distance [m]; the velocity, whether there is one, and whether it was refused for long; the line likewise.
INPUTS = {
    "elapsed": 1,
    "density": 1,
    "doubt": 1,
    "past": STATES,
    "age": 1,
    "normal": 3,
    "gravity": 3,
    "distance": 1,
    "velocity_new": 1,
    "velocity": 3,
    "velocity_covariance": 9,
    "refused_long": 1,
    "line_new": 1,
    "slot": 1,
    "starts": 1,
    "seen_s": 1,
    "line": 3,
    "vertical": 1,
    "paint": 1,
    "ends": 4,
}
#: Part of the way to the centre of a hollow wall up to which the tip's distance counts, and least curvature [1/m].
TOWARDS_CENTRE, FLATTEST = 0.75, 1e-6
#: Inputs of a picture without velocity, and without line.
_NO_VELOCITY, _NO_LINE = (0.0,) * 14, (0.0,) * 13
#: End points of a line without them.
_NO_ENDS = (0.0,) * 4


def unrolled(curvature: ca.SX, distance: ca.SX) -> ca.SX:
    r"""Way along a curved wall per way of a tip before it, (2, 2): :math:`(I + d K)^{-1}`.

    A tip at a distance d before a bulge moves on a larger circle than the place before it. Before a hollow wall the
    matrix is singular at the centre of its curvature; d counts up to `TOWARDS_CENTRE` of the way there.

    Args:
        curvature: Entries (right right, right down, down down) of K [1/m], (3,).
        distance: d [m].
    """
    first, both, second = ca.vertsplit(curvature)
    least = 0.5 * (first + second) - ca.sqrt(0.25 * (first - second) ** 2 + both * both)
    distance = ca.fmin(distance, TOWARDS_CENTRE / ca.fmax(-least, FLATTEST))
    first, both, second = ca.vertsplit(distance * curvature)
    first, second = 1.0 + first, 1.0 + second
    determinant = first * second - both * both
    return ca.vertcat(ca.horzcat(second, -both), ca.horzcat(-both, first)) / determinant


def predicted_motion(
    state: ca.SX,
    rates: ca.SX,
    axes: WallAxes,
    tip: Sequence[float],
    *,
    dt: ca.SX,
    force: ca.SX,
    rate: ca.SX,
    shrinks: ca.SX,
) -> ca.SX:
    """State after a tick, (n,): specific force and gyro integrated; the tip moves with the body's rotation, too.

    Args:
        state: State before it.
        rates: Change of every offset per metre of tip motion to the right and down, (SLOTS, 2).
        axes: Axes of the wall in B.
        tip: Brush tip in B [m], (3,).
        dt: Time since the last tick [s].
        force: Specific force in B [m/s^2], (3,).
        rate: Angular velocity in B [rad/s], (3,).
        shrinks: Way along the wall per way of the tip, (2, 2), see `unrolled`.
    """
    to_wall = ca.horzcat(axes.right, axes.down).T
    along, swing = to_wall @ (force + GRAVITY * axes.gravity), to_wall @ ca.cross(rate, ca.DM(tip))
    way = shrinks @ (dt * (state[VELOCITY] + swing))
    velocity = state[VELOCITY] + dt * (along - state[BIAS])
    return ca.vertcat(velocity, state[BIAS], state[ODOMETER] + way, state[LINES:] + rates @ way)


def correction_signals(tip_from_camera: list[float], config: EstimationConfig) -> Signals:
    """Correction of the motion by one measurement of a picture: by a velocity, or by a line.

    Results are the changes of the state at the capture (`LateKalman`); the caller carries them to the present.
    """
    signals = Signals()
    value = {name: signals.input(name, size) for name, size in INPUTS.items()}
    velocity_new, age, record = value["velocity_new"], value["age"], LineRecords(signals)
    chain = ca.SX(STATES, STATES)
    chain[VELOCITY, BIAS], chain[ODOMETER, VELOCITY], chain[LINES:, VELOCITY] = (
        -ca.SX.eye(2),
        ca.SX.eye(2),
        record.rates,
    )
    deviations = [VELOCITY_STD] * 2 + [BIAS_STD] * 2 + [ODOMETER_STD] * 2 + [UNUSED_STD] * SLOTS
    kalman = LateKalman(signals, "motion", chain, deviations, value["elapsed"])
    force_noise = ca.fmax(config.acceleration_noise**2, value["density"])
    kalman.noise = [force_noise] * 2 + [config.bias_noise**2] * 2 + [ODOMETER_NOISE] * 2 + record.walks
    for entry in range(VELOCITY.stop):
        kalman.set_entry(value["doubt"], entry, GAP_VELOCITY_STD)

    axes = WallAxes.of_symbols(value["normal"], value["gravity"])
    rho, theta, variance = ca.vertsplit(value["line"])
    ends = ca.vertsplit(value["ends"])
    measured = wall_line(rho, theta, value["vertical"], (ends[:2], ends[2:]), axes, tip_from_camera, value["distance"])
    slot = ca.vertcat(*(value["slot"] == place for place in range(SLOTS)))
    line = LineInput(value["line_new"], slot, value["starts"], value["seen_s"], variance, value["paint"], measured)
    found = correct_line(record, kalman, config, line, value["past"], age, velocity_new)

    to_wall = ca.horzcat(axes.right, axes.down).T
    covariance = to_wall @ ca.reshape(value["velocity_covariance"], 3, 3) @ to_wall.T
    seen, least = to_wall @ value["velocity"], config.velocity_std_m_s**2 * ca.SX.eye(2)
    innovation = seen - value["past"][VELOCITY]
    accepted, by_velocity = kalman.correct_first_two(velocity_new, innovation, covariance + least, config.gate_sigmas)
    # A filter that refuses the camera's velocity for long has a wrong bias as well.
    restart = both(velocity_new, no(accepted), value["refused_long"])
    for entry in range(BIAS.stop):
        kalman.set_entry(restart, entry, RESTART_VELOCITY_STD if entry < BIAS.start else RESTART_BIAS_STD)
    kalman.store()
    change = by_velocity + found.change
    result = Correction(
        accepted=where(velocity_new, accepted, found.accepted),
        restart=restart,
        track_ends=found.ends,
        offset=measured.offset,
        sign=measured.sign,
        seen_angle=measured.angle,
        middle=measured.middle,
        length=measured.length,
        deviation=found.deviation,
        angle=found.record.angle,
        angle_variance=found.record.spread,
        residual=found.record.residual,
        frames=found.record.frames,
    )
    signals.output("result", ca.vertcat(*result))
    signals.output("variance", ca.diag(kalman.covariance))
    signals.output("changes", ca.vertcat(change, *kalman.growth(change)))
    signals.output("seen_velocity", seen)
    signals.output("rates", ca.vertcat(found.record.right, found.record.down))
    return signals


class Correction(NamedTuple):
    """Result of a correction, of symbols or of numbers."""

    accepted: Any  # whether the velocity or the line is accepted
    restart: Any  # whether velocity and bias start anew
    track_ends: Any  # whether the line's track ends
    offset: Any  # measured offset of the line [m]
    sign: Any  # of its normal on the wall
    seen_angle: Any  # measured [rad]
    middle: Any  # of the visible piece [m]
    length: Any  # of that piece [m], negative without end points
    deviation: Any  # of the filtered offset [m]
    angle: Any  # filtered [rad]
    angle_variance: Any  # [rad^2]
    residual: Any  # of the offset [m]
    frames: Any  # that showed the line


class WallMotion:
    """Velocity right and down, odometer of the tip, and the tracked lines' offsets; corrected at the time of capture.

    Attributes:
        state: Velocity (2), accelerometer bias (2), odometer (2), offset of every line slot, as plain floats.
        lines: The tracked lines by identity.
        lines_ns: Capture of the last frame of which a line was accepted, -1 before the first [ns].
        density: Noise of a component of the specific force at the last tick [m^2/s^3].
        velocity_age_s: Time since the capture of the last accepted velocity, or of lines that give it [s].
        refused_s: How long the camera's velocities have been refused [s]; 0 while they are accepted.
        rates: Change of every offset per metre of tip motion to the right and down, (SLOTS, 2).

    Args:
        tip_from_camera: Brush tip from the camera in B [m], (3,).
        history: Remembered ticks, whose rows begin with the state.
        config: Noise models and life times.
        compiled: Whether the correction runs as machine code.
    """

    CONSTANTS = ("_memory", "_changes", "_seen", "_line_rates")

    def __init__(
        self, tip_from_camera: list[float], history: TickHistory, config: EstimationConfig, compiled: bool = False
    ) -> None:
        self._config, self._tip_from_camera, self._history = config, tip_from_camera, history
        self._step = step = StepFunction(correction_signals(tip_from_camera, config), to_machine_code=compiled)
        self._memory = memoryview(step.values)  # type: ignore[arg-type]
        self._pack = struct.Struct(f"{len(step.values)}d").pack_into
        self._changes, self._seen = step.outputs["changes"].reshape(3, STATES), step.outputs["seen_velocity"]
        self._line_rates = step.outputs["rates"]
        self.rates = np.zeros((SLOTS, 2))
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first frame."""
        self._step.reset()
        self.state: list[float] = [0.0] * STATES
        self.lines: dict[int, TrackedLine] = {}
        self.rates[:] = 0.0
        self._variance = [VELOCITY_STD**2] * 2 + [0.0] * (STATES - 2)
        self.velocity_age_s, self.refused_s, self.density, self._doubt = math.inf, 0.0, 0.0, False
        self.lines_ns = self._refused_stamp = self._stamp = self._frame_stamp = self._velocity_stamp = -1
        self._gap_end = self._corrected_stamp = -1

    @property
    def velocity_variance(self) -> float:
        """Trace of the velocity's covariance [m^2/s^2]."""
        return self._variance[0] + self._variance[1]

    def doubt(self) -> None:
        """Ticks are missing: the velocity is unknown."""
        self._doubt, self._variance[VELOCITY] = True, [GAP_VELOCITY_STD**2] * 2
        self._history.rows[:, VELOCITY] = self.state[VELOCITY]

    def remember(self, stamp_ns: int, row: np.ndarray, dt: float, density: float) -> None:
        """Store a predicted tick; fade and drop lines without new frames.

        Args:
            stamp_ns: Time of the tick.
            row: Row of the history, which begins with the state (`predicted_motion`).
            dt: Time since the last tick [s].
            density: Noise of a component of the specific force [m^2/s^3].
        """
        if 0 <= self._stamp < stamp_ns - GAP_NS:
            self.doubt()
            self._gap_end = stamp_ns
        self._history.add(stamp_ns, row, dt)
        self.state, self._stamp, self.density = row[:STATES].tolist(), stamp_ns, density
        start, end = self._config.fade_start_s, self._config.fade_end_s
        for line in tuple(self.lines.values()):
            line.offset, line.weight = self.state[LINES + line.slot], line.fresh_weight
            age = (stamp_ns - line.fresh_ns) * 1e-9
            if age > end:
                del self.lines[line.track_id]
            elif age > start:
                line.weight *= (end - age) / (end - start)
        self.velocity_age_s = (stamp_ns - self._velocity_stamp) * 1e-9 if self._velocity_stamp >= 0 else math.inf

    def correct(self, frame: FeatureFrame, normal: Sequence[float], gravity: Sequence[float], distance: float) -> None:
        """Correct with the features of a newer frame.

        A frame from a time without ticks corrects nothing: the state at its capture is not known.

        Args:
            frame: The features.
            normal: Unit vector into the wall, in B at capture, (3,).
            gravity: Unit vector of gravity, in B at capture, (3,).
            distance: Of the tip from the wall at capture [m].
        """
        if frame.stamp_ns <= self._frame_stamp:
            return
        self._frame_stamp = frame.stamp_ns
        if frame.stamp_ns < self._gap_end:
            return
        wall = (*normal, *gravity, distance)
        self._correct_velocity(frame, wall)
        place = self._history.find(frame.stamp_ns)
        for line in frame.lines:
            self._correct_line(line, frame.stamp_ns, place, wall)
        if self.lines_ns == frame.stamp_ns and max(self._variance[VELOCITY]) < KNOWN_STD**2:
            self._velocity_stamp = frame.stamp_ns
        self.state = self._history.newest[:STATES].tolist()

    def correct_velocity(
        self,
        velocity: np.ndarray,
        covariance: np.ndarray,
        stamp_ns: int,
        wall: Sequence[float],
        *,
        refused_long: bool = False,
    ) -> Correction | None:
        """Correct with a velocity of any sensor.

        Args:
            velocity: In B [m/s], (3,).
            covariance: Of it, (3, 3); large in directions that were not observed.
            stamp_ns: Time for which it holds.
            wall: Normal, gravity and distance as of `correct`, (7,).
            refused_long: Whether a refused one makes the filter start again.

        Returns:
            The result; None at a time without ticks.
        """
        place = self._history.find(stamp_ns)
        if place is None:
            return None
        values = 1.0, *velocity.tolist(), *covariance.ravel().tolist(), refused_long, *_NO_LINE
        found = self._evaluate(place, stamp_ns, wall, values)
        if found.accepted:
            self._history.change(place, self._changes)
            self.state = self._history.newest[:STATES].tolist()
        return found

    def _evaluate(self, place: int, stamp_ns: int, wall: Sequence[float], measurement: Sequence[float]) -> Correction:
        """Correct with one measurement of a time at a place of the history."""
        last, step = self._corrected_stamp, self._step
        self._pack(
            self._memory,
            0,
            (self._stamp - last) * 1e-9 if last >= 0 else 0.0,
            self.density,
            self._doubt,
            *self._history.rows[place, :STATES].tolist(),
            (self._stamp - stamp_ns) * 1e-9,
            *wall,
            *measurement,
        )
        step.evaluate()
        step.advance()
        self._doubt, self._corrected_stamp = False, self._stamp
        values, count = step.results.tolist(), len(Correction._fields)
        self._variance = values[count : count + STATES]
        return Correction(*values[:count])

    def _correct_velocity(self, frame: FeatureFrame, wall: Sequence[float]) -> None:
        if frame.velocity is None or frame.velocity_covariance is None or not math.isfinite(sum(frame.velocity)):
            return
        stamp, since, rows = frame.velocity_stamp_ns or frame.stamp_ns, self._refused_stamp, self._history.rows
        refused_s = (frame.stamp_ns - since) * 1e-9 if since >= 0 else 0.0
        long = refused_s > self._config.refusal_s
        found = self.correct_velocity(frame.velocity, frame.velocity_covariance, stamp, wall, refused_long=long)
        if found is not None and found.accepted:
            self._velocity_stamp, self._refused_stamp, self.refused_s = frame.stamp_ns, -1, 0.0
            return
        self._refused_stamp, self.refused_s = frame.stamp_ns if since < 0 else since, refused_s
        if found is not None and found.restart:
            rows[:, VELOCITY], rows[:, BIAS] = self._seen, self._history.newest[BIAS].copy()
            self._refused_stamp = -1

    def _correct_line(self, line: LineFeature, stamp_ns: int, place: int | None, wall: Sequence[float]) -> None:
        """Correct or start the track of a line whose frame has a place in the history."""
        track, history = self.lines.get(line.track_id), self._history
        starts = track is None
        if track is None:
            free = set(range(SLOTS)) - {known.slot for known in self.lines.values()}
            if not free:
                return
            track = TrackedLine(line.track_id, line.role, min(free), 0.0, 0.0, stamp_ns)
        elif place is None:
            return
        paint = (line.kind or track.kind) == "paint"
        seen_s, variance = (stamp_ns - track.seen_ns) * 1e-9, line.covariance.item(0)
        ends = _NO_ENDS if line.segment is None else line.segment.ravel().tolist()
        values = 1.0, track.slot, starts, seen_s, line.rho, line.theta, variance, line.role == VERTICAL, paint, *ends
        found = self._evaluate(history.place if place is None else place, stamp_ns, wall, (*_NO_VELOCITY, *values))
        if found.accepted and place is not None and not starts:
            history.change(place, self._changes)
            track.theta_variance = found.angle_variance
        elif found.accepted:
            entry, rates = LINES + track.slot, self._line_rates
            past = 0.0 if place is None else (history.rows[:, ODOMETER] - history.rows[place, ODOMETER]) @ rates
            history.rows[:, entry] = found.offset + past
            self.lines[line.track_id], track.offset = track, history.newest.item(entry)
        else:
            track.residual = found.residual
            if found.track_ends:
                del self.lines[line.track_id]
            return
        self.rates[track.slot] = self._line_rates
        track.frames, track.angle, track.deviation = int(found.frames), found.angle, found.deviation
        track.residual, track.seen_angle = found.residual, found.seen_angle
        seen = line.segment is not None and found.length >= 0.0
        track.middle, track.length = (found.middle, found.length) if seen else (math.nan, 0.0)
        track.seen_ns, track.fresh_ns, self.lines_ns = stamp_ns, self._stamp, max(self.lines_ns, stamp_ns)
        track.fresh_weight = min(1.0, track.frames / self._config.frames_to_trust) * line.weight
        track.surface_side, track.kind = int(found.sign) * line.surface_side, line.kind or track.kind

    def feature(self, line: TrackedLine, axes: WallAxes, distance: float, stamp_ns: int) -> LineFeature:
        """The line in the image now, with wall axes in B and the distance of the tip [m]."""
        rho, theta, scale = image_line(line.offset, line.angle, axes, self._tip_from_camera, distance)
        variance = max(self._variance[LINES + line.slot], LEAST_VARIANCE) / (scale * scale)
        return LineFeature(
            rho=rho,
            theta=theta,
            covariance=np.array(((variance, 0.0), (0.0, line.theta_variance))),
            role=line.role,
            weight=line.weight,
            stamp_ns=stamp_ns,
            track_id=line.track_id,
            surface_side=line.surface_side,
            kind=line.kind,
        )
