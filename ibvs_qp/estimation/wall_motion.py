"""Motion in the wall plane, filtered in metres and predicted from late frames to now."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.config import EstimationConfig
from ibvs_qp.estimation.kalman import DelayedKalman
from ibvs_qp.estimation.line_tracking import LINES, SLOTS, LineTracks
from ibvs_qp.estimation.stamps import StampRing
from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.estimation.wall_lines import WallAxes, image_line, wall_line
from ibvs_qp.frames import GRAVITY, add_scaled, cross, dot
from ibvs_qp.measurement import FeatureFrame, LineFeature

#: Order of the filter's state, each (right, down): velocity [m/s], accelerometer bias [m/s^2], odometer [m]; then the
#: offset of every line [m] (`LINES`).
VELOCITY, BIAS, ODOMETER = slice(0, 2), slice(2, 4), slice(4, 6)
#: Spectral density of the odometer itself [m^2/s]: nearly none.
ODOMETER_NOISE = 1e-10
#: Standard deviations at the start: velocity [m/s], bias [m/s^2], odometer [m].
VELOCITY_STD, BIAS_STD, ODOMETER_STD = 0.05, 0.1, 1e-6
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


class WallMotion:
    """Velocity right and down, odometer of the tip, and the tracked lines' offsets; corrected at the time of capture.

    Attributes:
        state: Velocity (2), accelerometer bias (2), odometer (2), offset of every line slot, as plain floats.
        velocity_age_s: Time since the capture of the last accepted velocity, or of lines that give it [s].
        refused_s: How long the camera's velocities have been refused [s]; 0 while they are accepted.

    Args:
        tip: Brush tip in B [m], (3,).
        camera: Camera centre in B [m], (3,).
        tick_s: Nominal control period [s].
        config: Noise models and life times.
    """

    def __init__(
        self, tip: np.ndarray, camera: np.ndarray, tick_s: float, config: EstimationConfig | None = None
    ) -> None:
        self._config = config = config or EstimationConfig()
        self._tip = np.asarray(tip, float).tolist()
        self._tip_from_camera = (np.asarray(tip, float) - np.asarray(camera, float)).tolist()
        size = LINES + SLOTS
        chain, noise, deviation = np.zeros((size, size)), np.full(size, config.line_noise**2), np.zeros(size)
        chain[VELOCITY, BIAS], chain[ODOMETER, VELOCITY] = -np.eye(2), np.eye(2)
        noise[VELOCITY], noise[BIAS] = config.acceleration_noise**2, config.bias_noise**2
        noise[ODOMETER] = ODOMETER_NOISE
        deviation[VELOCITY], deviation[BIAS], deviation[ODOMETER] = VELOCITY_STD, BIAS_STD, ODOMETER_STD
        self._filter = DelayedKalman(chain, noise, deviation, tick_s, config.gate_sigmas)
        self._velocity_floor = config.velocity_std_m_s**2 * np.eye(2)
        self._tracks = LineTracks(self._filter, config)
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first frame."""
        self._filter.reset()
        self._tracks.reset()
        self.state: list[float] = self._filter.state.tolist()
        self.velocity_age_s, self.refused_s = math.inf, 0.0
        self._refused_stamp = -1
        self._stamp = self._frame_stamp = self._velocity_stamp = self._gap_end = -1

    @property
    def lines(self) -> dict[int, TrackedLine]:
        """The tracked lines by identity."""
        return self._tracks.lines

    @property
    def lines_ns(self) -> int:
        """Capture of the last frame of which a line was accepted, -1 before the first [ns]."""
        return self._tracks.seen_ns

    @property
    def ticks(self) -> StampRing:
        """Stamps of the ticks remembered."""
        return self._filter.ticks

    @property
    def velocity_variance(self) -> float:
        """Trace of the velocity's covariance [m^2/s^2]."""
        return float(np.trace(self._filter.covariance[VELOCITY, VELOCITY]))

    def doubt(self) -> None:
        """Ticks are missing: the velocity is unknown."""
        for entry in range(2):
            self._filter.set_entry(entry, self.state[entry], GAP_VELOCITY_STD)

    def predict(
        self,
        stamp_ns: int,
        axes: WallAxes,
        specific_force: Sequence[float],
        omega: Sequence[float],
        dt: float,
        density: float,
    ) -> None:
        """Integrate specific force and gyro over a tick; the tip moves with the body's rotation, too.

        Args:
            stamp_ns: Time of the tick.
            axes: Axes of the wall in B.
            specific_force: In B [m/s^2], (3,).
            omega: Angular velocity in B [rad/s], (3,).
            dt: Time since the last tick [s].
            density: Noise of a component of the force [m^2/s^3], at least that of the settings.
        """
        if 0 <= self._stamp < stamp_ns - GAP_NS:
            self.doubt()
            self._gap_end = stamp_ns
        acceleration, swing = add_scaled(specific_force, GRAVITY, axes.gravity), cross(omega, self._tip)
        state = self.state.copy()
        velocity_right, velocity_down, bias_right, bias_down, *_ = state
        right = dt * (velocity_right + dot(axes.right, swing))
        down = dt * (velocity_down + dot(axes.down, swing))
        along = dot(axes.right, acceleration), dot(axes.down, acceleration)
        state[0] += dt * (along[0] - bias_right)
        state[1] += dt * (along[1] - bias_down)
        for entry in range(VELOCITY.start, VELOCITY.stop):
            self._filter.noise[entry, entry] = max(self._config.acceleration_noise**2, density)
        state[4] += right
        state[5] += down
        self._tracks.advance(stamp_ns, state, right, down)
        self._filter.remember(stamp_ns, state, dt)
        self.state, self._stamp = state, stamp_ns
        self.velocity_age_s = (stamp_ns - self._velocity_stamp) * 1e-9 if self._velocity_stamp >= 0 else math.inf

    def correct(self, frame: FeatureFrame, axes: WallAxes, distance: float) -> None:
        """Correct with the features of a newer frame; axes and distance of the tip [m] are those at capture.

        A frame from a time without ticks corrects nothing: the state at its capture is not known.
        """
        if frame.stamp_ns <= self._frame_stamp:
            return
        self._frame_stamp = frame.stamp_ns
        if frame.stamp_ns < self._gap_end:
            return
        self._correct_velocity(frame, axes)
        for line in frame.lines:
            measured = wall_line(line, axes, self._tip_from_camera, distance)
            if measured is not None:
                self._tracks.correct(line, measured, frame.stamp_ns, self._stamp)
        seen = self._tracks.seen_ns == frame.stamp_ns
        if seen and max(self._filter.covariance[0, 0], self._filter.covariance[1, 1]) < KNOWN_STD**2:
            self._velocity_stamp = frame.stamp_ns
        self.state = self._filter.state.tolist()

    def _correct_velocity(self, frame: FeatureFrame, axes: WallAxes) -> None:
        if frame.velocity is None or frame.velocity_covariance is None or not math.isfinite(sum(frame.velocity)):
            return
        to_wall = np.array((axes.right, axes.down))
        covariance = to_wall @ frame.velocity_covariance @ to_wall.T + self._velocity_floor
        stamp = frame.velocity_stamp_ns or frame.stamp_ns
        velocity = to_wall @ frame.velocity
        if self._filter.correct_pair(stamp, 0, velocity, covariance):
            self._velocity_stamp, self._refused_stamp, self.refused_s = frame.stamp_ns, -1, 0.0
            return
        if self._refused_stamp < 0:
            self._refused_stamp = frame.stamp_ns
        self.refused_s = (frame.stamp_ns - self._refused_stamp) * 1e-9
        if self.refused_s > self._config.refusal_s and self._filter.ticks.age(stamp) is not None:
            self._restart(velocity.tolist())

    def _restart(self, velocity: list[float]) -> None:
        """Take the velocity (right, down) from the camera: a filter that refuses it has a wrong bias as well."""
        for entry, seen in enumerate(velocity):
            self._filter.set_entry(entry, seen, RESTART_VELOCITY_STD)
            bias = BIAS.start + entry
            self._filter.set_entry(bias, float(self._filter.state[bias]), RESTART_BIAS_STD)
        self._refused_stamp = -1

    def feature(self, line: TrackedLine, axes: WallAxes, distance: float, stamp_ns: int) -> LineFeature:
        """The line in the image now, with wall axes in B and the distance of the tip [m]."""
        rho, theta, scale = image_line(line.offset, line.angle, axes, self._tip_from_camera, distance)
        entry = LINES + line.slot
        variance = max(float(self._filter.covariance[entry, entry]), LEAST_VARIANCE) / (scale * scale)
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
