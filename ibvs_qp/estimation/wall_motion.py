"""Motion in the wall plane and the lines on it, filtered in metres and predicted from late pictures to now."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.estimation.config import EstimationConfig
from ibvs_qp.estimation.kalman import DelayedKalman
from ibvs_qp.estimation.line_noise import SteadyValue, WhiteNoise
from ibvs_qp.estimation.stamps import StampRing
from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.estimation.wall_lines import WallAxes, image_line, wall_line
from ibvs_qp.frames import GRAVITY
from ibvs_qp.measurement import FeatureFrame, LineFeature

#: Lines followed at once.
SLOTS = 8

_NOTHING = np.zeros((2, 2))
_VELOCITY, _BIAS, _ODOMETER, _LINES = slice(0, 2), slice(2, 4), slice(4, 6), 6


class WallMotion:
    """Velocity right and down, a tip odometer, and the tracked lines' offsets; corrected at the time of capture.

    Attributes:
        state: Velocity (2), accelerometer bias (2), odometer (2), offset of every line slot, as plain numbers.
        lines: The tracked lines by identity.
    """

    def __init__(
        self,
        tip: np.ndarray,
        camera: np.ndarray,
        tick_s: float,
        config: EstimationConfig | None = None,
        to_machine_code: bool = False,
    ) -> None:
        self._config = config = config or EstimationConfig()
        self._fading_after = min(config.fade_start_s, config.fade_end_s)
        self._tip = np.asarray(tip, float).tolist()
        self._tip_from_camera = (np.asarray(tip, float) - np.asarray(camera, float)).tolist()
        size = _LINES + SLOTS
        chain = np.zeros((size, size))
        chain[0, 2] = chain[1, 3] = -1.0
        chain[4, 0] = chain[5, 1] = 1.0
        noise = np.full(size, config.line_noise**2)
        noise[_VELOCITY], noise[_BIAS] = config.acceleration_noise**2, config.bias_noise**2
        noise[_ODOMETER] = 1e-10
        deviation = np.full(size, 0.05)
        deviation[_BIAS], deviation[_ODOMETER] = 0.1, 1e-6
        pattern = chain != 0.0
        pattern[_LINES:, _VELOCITY] = True
        self._filter = DelayedKalman(chain, noise, deviation, tick_s, pattern, to_machine_code)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._filter.reset()
        self._filter.chain[_LINES:, :] = 0.0
        self.state: list[float] = self._filter.state.tolist()
        self.lines: dict[int, TrackedLine] = {}
        self._stamp = -1
        self._frame_stamp = -1
        self.velocity_age_s = math.inf
        self._velocity_stamp = -1
        self._noise_rho, self._noise_theta = WhiteNoise(), WhiteNoise()  # what all lines have shown

    @property
    def ticks(self) -> StampRing:
        """Stamps of the ticks remembered."""
        return self._filter.ticks

    @property
    def velocity(self) -> np.ndarray:
        """Velocity of the centre of mass (right, down) [m/s], (2,)."""
        return np.array(self.state[_VELOCITY])

    @property
    def velocity_covariance(self) -> np.ndarray:
        """Covariance of the velocity, (2, 2)."""
        return self._filter.covariance[_VELOCITY, _VELOCITY]

    @property
    def velocity_variance(self) -> float:
        """Trace of `velocity_covariance` [m^2/s^2]."""
        covariance = self._filter.covariance
        return covariance.item(0, 0) + covariance.item(1, 1)

    @property
    def odometer(self) -> np.ndarray:
        """Path of the tip's wall point since the start (right, down) [m], (2,)."""
        return np.array(self.state[_ODOMETER])

    def predict(
        self, stamp_ns: int, axes: WallAxes, specific_force: Sequence[float], omega: Sequence[float], dt: float
    ) -> None:
        """Integrate the accelerometer in the wall plane; the tip moves with the body's turn as well."""
        # Plain numbers: the chain is sparse, and this runs every tick.
        (rx, ry, rz), (dx, dy, dz), (gx, gy, gz) = axes.right, axes.down, axes.gravity
        fx, fy, fz = specific_force
        ax, ay, az = fx + GRAVITY * gx, fy + GRAVITY * gy, fz + GRAVITY * gz
        (wx, wy, wz), (tx, ty, tz) = omega, self._tip
        lx, ly, lz = wy * tz - wz * ty, wz * tx - wx * tz, wx * ty - wy * tx
        right, down = dt * (rx * lx + ry * ly + rz * lz), dt * (dx * lx + dy * ly + dz * lz)
        state = self.state.copy()
        vr, vd, br, bd, *_ = state
        state[0] = vr + dt * (rx * ax + ry * ay + rz * az - br)
        state[1] = vd + dt * (dx * ax + dy * ay + dz * az - bd)
        state[4] += dt * vr + right
        state[5] += dt * vd + down
        right, down = right + dt * vr, down + dt * vd
        fading = False
        for line in self.lines.values():
            c, s = line.rates
            slot = _LINES + line.slot
            line.offset = state[slot] = state[slot] + (c * right + s * down)
            line.weight = line.fresh_weight
            fading = fading or (stamp_ns - line.news_ns) * 1e-9 > self._fading_after
        self._filter.remember(stamp_ns, state, dt)
        self.state, self._stamp = state, stamp_ns
        if fading:
            self._fade(stamp_ns)
        self.velocity_age_s = (stamp_ns - self._velocity_stamp) * 1e-9 if self._velocity_stamp >= 0 else math.inf

    def _fade(self, stamp_ns: int) -> None:
        """Lines that no picture shows any more fade and go."""
        start, end, old = self._config.fade_start_s, self._config.fade_end_s, []
        for key, line in self.lines.items():
            age = (stamp_ns - line.news_ns) * 1e-9
            if age > end:
                old.append(key)
            elif age > start:
                line.weight = line.fresh_weight * ((end - age) / (end - start))
        for key in old:
            self._drop(key)

    def _drop(self, key: int) -> None:
        slot = _LINES + self.lines.pop(key).slot
        self._filter.chain[slot, :] = 0.0
        self._filter.set_entry(slot, 0.0, 0.05)
        self.state[slot] = 0.0

    def correct(self, frame: FeatureFrame, axes: WallAxes, foot_distance: float) -> None:
        """Take in what perception saw.

        Args:
            frame: Features at capture.
            axes: Wall axes in B at capture.
            foot_distance: Tip to wall along the normal at capture [m].
        """
        if frame.stamp_ns <= self._frame_stamp:
            return
        self._frame_stamp = frame.stamp_ns
        self._correct_velocity(frame, axes)
        for line in frame.lines:
            seen = wall_line(line, axes, self._tip_from_camera, foot_distance)
            if seen is not None:
                self._correct_line(line, *seen, frame.stamp_ns)
        self.state = self._filter.state.tolist()

    def _correct_velocity(self, frame: FeatureFrame, axes: WallAxes) -> None:
        if frame.velocity is None or frame.velocity_covariance is None:
            return
        x, y, z = frame.velocity.tolist()
        if not math.isfinite(x + y + z):
            return
        (rx, ry, rz), (dx, dy, dz) = axes.right, axes.down
        right, down = rx * x + ry * y + rz * z, dx * x + dy * y + dz * z
        rows = frame.velocity_covariance.tolist()
        ux, uy, uz = [a * rx + b * ry + c * rz for a, b, c in rows]
        vx, vy, vz = [a * dx + b * dy + c * dz for a, b, c in rows]
        aa, ab, bb = rx * ux + ry * uy + rz * uz, rx * vx + ry * vy + rz * vz, dx * vx + dy * vy + dz * vz
        floor = self._config.velocity_std_m_s**2
        stamp = frame.velocity_stamp_ns or frame.stamp_ns
        if self._filter.correct_pair(stamp, 0, (right, down), (aa + floor, ab, bb + floor)):
            self._velocity_stamp = frame.stamp_ns

    def _correct_line(
        self, line: LineFeature, offset: float, angle: float, side: int, scale: float, stamp: int
    ) -> None:
        variance = self._config.line_std_m**2 + max(line.covariance.item(0, 0), 0.0) * scale * scale
        tracked = self.lines.get(line.track_id)
        if tracked is None:
            tracked = self._admit(line, offset, angle, scale, variance, stamp)
            if tracked is None:
                return
        elif tracked.seen_ns != stamp and not self._correct_offset(tracked, offset, scale, variance, stamp):
            return
        else:
            self._correct_angle(tracked, angle, stamp)
        if tracked.seen_ns != stamp:
            tracked.frames += 1
        tracked.seen_ns = stamp
        tracked.fresh_weight = min(1.0, tracked.frames / self._config.frames_to_trust) * line.weight
        tracked.news_ns = self._stamp
        tracked.surface_side, tracked.kind = side, line.kind or tracked.kind
        self._point(tracked)

    def _correct_offset(self, line: TrackedLine, offset: float, scale: float, variance: float, stamp: int) -> bool:
        """Correct with one offset, as noisy as the line has shown itself; False if it is not believed."""
        slot = _LINES + line.slot
        past = self._filter.entry(stamp, slot)
        if past is None:
            return False
        innovation = offset - past
        difference = line.noise.difference(innovation)
        sample = line.noise.learn(difference, variance)
        self._noise_rho.mix(sample / (scale * scale))
        variance, covariance = line.noise.total(variance), self._filter.covariance
        least = variance / line.frames  # see SteadyValue
        if covariance.item(slot, slot) < least:
            covariance[slot, slot] = least
        if not self._filter.correct_entry(stamp, slot, offset, variance):
            line.noise.keep(innovation)
            if line.is_another(difference, variance):
                self._drop(line.track_id)
            return False
        past = self._filter.entry(stamp, slot)  # corrected by now
        line.noise.keep(innovation if past is None else offset - past)
        line.deviation = math.sqrt(covariance.item(slot, slot))
        line.refused = 0
        return True

    def _correct_angle(self, line: TrackedLine, angle: float, stamp: int) -> None:
        config = self._config  # a fit's own claim is left out: on a short fresh edge it is three times too cautious
        walk = config.angle_noise**2 * (stamp - line.seen_ns) * 1e-9
        self._noise_theta.mix(line.tilt.correct(angle, config.angle_std_rad**2, walk))
        line.angle, line.theta_variance = line.tilt.value, line.tilt.spread

    def _admit(
        self, line: LineFeature, offset: float, angle: float, scale: float, variance: float, stamp: int
    ) -> TrackedLine | None:
        taken = {entry.slot for entry in self.lines.values()}
        free = [slot for slot in range(SLOTS) if slot not in taken]
        if not free:
            return None
        noise = WhiteNoise.like(self._noise_rho, scale * scale)
        deviation, turn = math.sqrt(noise.total(variance)), WhiteNoise.like(self._noise_theta)
        tracked = TrackedLine(
            track_id=line.track_id,
            role=line.role,
            slot=free[0],
            angle=angle,
            deviation=deviation,
            seen_ns=stamp,
            noise=noise,
            tilt=SteadyValue(value=angle, spread=turn.total(self._config.angle_std_rad**2), noise=turn),
        )
        tracked.noise.keep(0.0)
        tracked.tilt.noise.keep(0.0)
        tracked.news_ns = self._stamp
        self.lines[line.track_id] = tracked
        slot = _LINES + tracked.slot
        rates = np.zeros(_LINES + SLOTS)
        rates[_ODOMETER] = -math.cos(angle), -math.sin(angle)
        self._filter.set_path(slot, offset, stamp, rates, deviation)
        self._point(tracked)
        tracked.offset = float(self._filter.state[slot])
        return tracked

    def _point(self, line: TrackedLine) -> None:
        """Let the filter know how a line's offset follows the velocity: against its normal."""
        line.rates = right, down = -math.cos(line.angle), -math.sin(line.angle)
        chain, slot = self._filter.chain, _LINES + line.slot
        chain[slot, 0], chain[slot, 1] = right, down

    def feature(self, line: TrackedLine, axes: WallAxes, foot_distance: float, stamp_ns: int) -> LineFeature:
        """The line as the camera would see it now: rho, theta at the tick's own time."""
        rho, theta, scale = image_line(line.offset, line.angle, axes, self._tip_from_camera, foot_distance)
        slot = _LINES + line.slot
        variance = max(self._filter.covariance.item(slot, slot), 1e-10) / (scale * scale)
        covariance = _NOTHING.copy()
        covariance[0, 0], covariance[1, 1] = variance, line.theta_variance
        return LineFeature(
            rho=rho,
            theta=theta,
            covariance=covariance,
            role=line.role,
            weight=line.weight,
            stamp_ns=stamp_ns,
            track_id=line.track_id,
            segment=None,
            surface_side=line.surface_side,
            kind=line.kind,
        )
