"""Motion in the wall plane and the lines on it, filtered in metres and predicted from late pictures to now."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ibvs_qp.estimation.config import EstimationConfig
from ibvs_qp.estimation.delayed import DelayedKalman
from ibvs_qp.estimation.wall_lines import WallAxes, image_line, wall_line
from ibvs_qp.frames import GRAVITY
from ibvs_qp.made import made
from ibvs_qp.measurement import FeatureFrame, LineFeature
from ibvs_qp.vectors import cross_product

#: Lines followed at once.
SLOTS = 8

_VELOCITY, _BIAS, _ODOMETER, _LINES = slice(0, 2), slice(2, 4), slice(4, 6), 6


@dataclass(slots=True)
class TrackedLine:
    """One line on the wall, in metres from the tip's wall point.

    Attributes:
        offset: Signed distance from the tip to the line along its normal [m]; normals point down (horizontal lines)
            or right (vertical lines), so > 0 is below or right of the tip.
        angle: Angle of the normal in (right, down) [rad]; pi/2 for a level line.
        rates: Offset per unit of the tip's motion (right, down).
    """

    track_id: int
    role: str
    slot: int
    angle: float
    deviation: float
    seen_ns: int
    news_ns: int = 0
    frames: int = 1
    offset: float = 0.0
    weight: float = 0.0
    surface_side: int = 0
    kind: str = ""
    source_weight: float = 1.0
    theta_variance: float = 1e-4
    rates: tuple[float, float] = (0.0, 0.0)
    extra: dict[str, float] = field(default_factory=dict)


class WallMotion:
    """Velocity right and down, a tip odometer, and the tracked lines' offsets; corrected at the time of capture.

    Attributes:
        state: Velocity (2), accelerometer bias (2), odometer (2), offset of every line slot, as plain numbers.
        lines: The tracked lines by identity.
    """

    def __init__(
        self, tip: np.ndarray, camera: np.ndarray, tick_s: float, config: EstimationConfig | None = None
    ) -> None:
        self._config = config = config or EstimationConfig()
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
        self._filter = DelayedKalman(chain, noise, deviation, tick_s)
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
        lx, ly, lz = cross_product(omega, self._tip)
        right, down = dt * (rx * lx + ry * ly + rz * lz), dt * (dx * lx + dy * ly + dz * lz)
        state = self.state.copy()
        vr, vd, br, bd, *_ = state
        state[0] = vr + dt * (rx * ax + ry * ay + rz * az - br)
        state[1] = vd + dt * (dx * ax + dy * ay + dz * az - bd)
        state[4] += dt * vr + right
        state[5] += dt * vd + down
        right, down = right + dt * vr, down + dt * vd
        for line in self.lines.values():
            c, s = line.rates
            state[_LINES + line.slot] += c * right + s * down
        self._filter.remember(stamp_ns, state, dt)
        self.state, self._stamp = state, stamp_ns
        self._refresh(stamp_ns)

    def _refresh(self, stamp_ns: int) -> None:
        config, old = self._config, []
        for key, line in self.lines.items():
            age = (stamp_ns - line.news_ns) * 1e-9
            if age > config.fade_end_s:
                old.append(key)
                continue
            weight = min(1.0, line.frames / config.frames_to_trust) * line.source_weight
            if age > config.fade_start_s:
                weight *= (config.fade_end_s - age) / (config.fade_end_s - config.fade_start_s)
            line.weight = weight
            line.offset = self.state[_LINES + line.slot]
        for key in old:
            self._drop(key)
        self.velocity_age_s = (stamp_ns - self._velocity_stamp) * 1e-9 if self._velocity_stamp >= 0 else math.inf

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
        if frame.velocity is None or frame.velocity_covariance is None or not np.isfinite(frame.velocity).all():
            return
        plane = np.array((axes.right, axes.down))
        (aa, ab), (_, bb) = (plane @ frame.velocity_covariance @ plane.T).tolist()
        right, down = (plane @ frame.velocity).tolist()
        floor = self._config.velocity_std_m_s**2
        stamp = frame.velocity_stamp_ns or frame.stamp_ns
        if self._filter.correct_pair(stamp, 0, (right, down), (aa + floor, ab, bb + floor)):
            self._velocity_stamp = frame.stamp_ns

    def _correct_line(
        self, line: LineFeature, offset: float, angle: float, side: int, scale: float, stamp: int
    ) -> None:
        deviation = math.hypot(self._config.line_std_m, math.sqrt(max(float(line.covariance[0, 0]), 0.0)) * scale)
        tracked = self.lines.get(line.track_id)
        if tracked is None:
            tracked = self._admit(line, offset, angle, deviation, stamp)
            if tracked is None:
                return
        slot = _LINES + tracked.slot
        if tracked.seen_ns != stamp and not self._filter.correct_entry(stamp, slot, offset, deviation**2):
            tracked.extra["refused"] = tracked.extra.get("refused", 0.0) + 1.0
            if tracked.extra["refused"] >= 3:  # three frames agree with each other, not with the prediction
                self._drop(line.track_id)
            return
        tracked.extra.pop("refused", None)
        tracked.angle += self._config.angle_gain * (angle - tracked.angle)
        tracked.frames += tracked.seen_ns != stamp
        tracked.seen_ns, tracked.deviation, tracked.source_weight = stamp, deviation, line.weight
        tracked.news_ns = self._stamp
        tracked.theta_variance = float(line.covariance[1, 1])
        tracked.surface_side, tracked.kind = side, line.kind or tracked.kind
        self._point(tracked)

    def _admit(
        self, line: LineFeature, offset: float, angle: float, deviation: float, stamp: int
    ) -> TrackedLine | None:
        taken = {entry.slot for entry in self.lines.values()}
        free = [slot for slot in range(SLOTS) if slot not in taken]
        if not free:
            return None
        tracked = TrackedLine(
            track_id=line.track_id, role=line.role, slot=free[0], angle=angle, deviation=deviation, seen_ns=stamp
        )
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
        line.rates = -math.cos(line.angle), -math.sin(line.angle)
        self._filter.chain[_LINES + line.slot, _VELOCITY] = line.rates

    def feature(self, line: TrackedLine, axes: WallAxes, foot_distance: float, stamp_ns: int) -> LineFeature:
        """The line as the camera would see it now: rho, theta at the tick's own time."""
        rho, theta, scale = image_line(line.offset, line.angle, axes, self._tip_from_camera, foot_distance)
        slot = _LINES + line.slot
        variance = max(self._filter.covariance.item(slot, slot), 1e-10) / (scale * scale)
        return made(
            LineFeature,
            rho=rho,
            theta=theta,
            covariance=np.array(((variance, 0.0), (0.0, line.theta_variance))),
            role=line.role,
            weight=line.weight,
            stamp_ns=stamp_ns,
            track_id=line.track_id,
            segment=None,
            surface_side=line.surface_side,
            kind=line.kind,
        )
