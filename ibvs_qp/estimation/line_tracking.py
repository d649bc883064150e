"""Lines on the wall tracked from frame to frame: start, correction, fading and end of a track."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.config import EstimationConfig
from ibvs_qp.estimation.kalman import DelayedKalman
from ibvs_qp.estimation.line_noise import SteadyValue, WhiteNoise
from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.estimation.wall_lines import MeasuredLine
from ibvs_qp.measurement import LineFeature

#: Lines tracked at once, and where their offsets begin in the filter's state (after velocity, bias and odometer).
SLOTS, LINES = 8, 6
#: Standard deviation of an unused entry of the filter [m].
UNUSED_STD = 0.05


class LineTracks:
    """The tracked lines; their offsets are entries of the filter of the motion in the wall plane.

    Attributes:
        lines: The lines by identity.
        seen_ns: Capture of the last frame of which a line was accepted, -1 before the first.

    Args:
        motion: Filter whose state ends with `SLOTS` offsets; entries 0 and 1 are the velocity, 4 and 5 the odometer.
        config: Noise models and life times.
    """

    def __init__(self, motion: DelayedKalman, config: EstimationConfig) -> None:
        self._filter, self._config = motion, config
        self.reset()

    def reset(self) -> None:
        """Drop every line."""
        self.lines: dict[int, TrackedLine] = {}
        self.seen_ns = -1
        self._noise_rho, self._noise_theta = WhiteNoise(), WhiteNoise()  # of all lines: the prior of a new one
        self._filter.chain[LINES:, :] = 0.0
        for slot in range(SLOTS):
            self._filter.set_entry(LINES + slot, 0.0, UNUSED_STD)

    def advance(self, stamp_ns: int, state: list[float], right: float, down: float) -> None:
        """Predict the offsets in the state of a new tick; fade and drop lines without new frames.

        ``state`` holds the offsets of the last tick and is advanced in place by the path of the tip right and down [m].
        """
        start, end, old = self._config.fade_start_s, self._config.fade_end_s, []
        for line in self.lines.values():
            entry, (per_right, per_down) = LINES + line.slot, line.rates
            state[entry] += per_right * right + per_down * down
            line.offset, line.weight = state[entry], line.fresh_weight
            age = (stamp_ns - line.news_ns) * 1e-9
            if age > end:
                old.append(line)
            elif age > start:
                line.weight *= (end - age) / (end - start)
        for line in old:
            state[LINES + line.slot] = 0.0
            self._drop(line)

    def correct(self, line: LineFeature, measured: MeasuredLine, stamp: int, tick_ns: int) -> None:
        """Correct or start the track of a line in the image, measured on the wall at a time of capture.

        ``tick_ns`` is the time of the tick at which the frame arrived.
        """
        variance = self._config.line_std_m**2 + max(float(line.covariance[0, 0]), 0.0) * measured.scale**2
        track = self.lines.get(line.track_id)
        if track is None:
            track = self._start(line, measured, variance, stamp)
            if track is None:
                return
        elif track.seen_ns != stamp and not self._correct_offset(track, measured, variance, stamp):
            return
        else:
            self._correct_angle(track, measured.angle, stamp)
        if track.seen_ns != stamp:
            track.frames += 1
        track.seen_ns, track.news_ns = stamp, tick_ns
        self.seen_ns = max(self.seen_ns, stamp)
        track.fresh_weight = min(1.0, track.frames / self._config.frames_to_trust) * line.weight
        track.surface_side, track.kind = measured.surface_side, line.kind or track.kind
        # A painted edge grows behind the brush and swings ahead of it: its offset says little of the velocity.
        walk = self._config.paint_noise if track.kind == "paint" else self._config.line_noise
        self._filter.noise[LINES + track.slot, LINES + track.slot] = walk**2
        track.seen_angle, track.middle, track.length = measured.angle, measured.middle, measured.length
        self._couple(track)

    def _correct_offset(self, track: TrackedLine, measured: MeasuredLine, claimed: float, stamp: int) -> bool:
        """Correct with one offset, as noisy as the line's frames show; False if it is refused."""
        entry, past, noise = LINES + track.slot, self._filter.at(stamp), track.noise
        if past is None:
            return False
        innovation = measured.offset - float(past[entry])
        difference = innovation - noise.residual
        sample = noise.learn(difference, claimed)
        self._noise_rho.average(sample / measured.scale**2)
        variance = noise.total(claimed)
        covariance = self._filter.covariance
        covariance[entry, entry] = max(covariance[entry, entry], variance / track.frames)  # as in SteadyValue
        if not self._filter.correct_entry(stamp, entry, measured.offset, variance):
            noise.residual = innovation
            self._refuse(track, difference, variance)
            return False
        noise.residual = measured.offset - float(past[entry])  # `past` is corrected by now
        track.deviation = math.sqrt(self._filter.covariance[entry, entry])
        track.refused = 0
        return True

    def _refuse(self, track: TrackedLine, difference: float, variance: float) -> None:
        """Drop the track once several refused offsets in a row agree with each other: it is another line then.

        New noise scatters: its offsets do not agree and are only refused until it is learned. ``difference`` is
        between the residuals of this frame and the last [m].
        """
        agrees = difference * difference < 2.0 * self._config.gate_sigmas**2 * variance
        track.refused = track.refused + 1 if agrees else 1
        if track.refused >= self._config.refused_frames:
            self._drop(track)

    def _correct_angle(self, track: TrackedLine, angle: float, stamp: int) -> None:
        # The fit's own variance is not used: on a short fresh edge it is three times too large.
        walk = self._config.angle_noise**2 * (stamp - track.seen_ns) * 1e-9
        self._noise_theta.average(track.tilt.correct(angle, self._config.angle_std_rad**2, walk))
        track.angle, track.theta_variance = track.tilt.value, track.tilt.spread

    def _start(self, line: LineFeature, measured: MeasuredLine, variance: float, stamp: int) -> TrackedLine | None:
        """A new track from the first frame of a line; None if all slots are taken."""
        free = set(range(SLOTS)) - {track.slot for track in self.lines.values()}
        if not free:
            return None
        noise, angle_noise = WhiteNoise.like(self._noise_rho, measured.scale**2), WhiteNoise.like(self._noise_theta)
        spread = angle_noise.total(self._config.angle_std_rad**2)
        track = TrackedLine(
            track_id=line.track_id,
            role=line.role,
            slot=min(free),
            angle=measured.angle,
            deviation=math.sqrt(noise.total(variance)),
            seen_ns=stamp,
            noise=noise,
            tilt=SteadyValue(value=measured.angle, spread=spread, noise=angle_noise),
        )
        self.lines[line.track_id] = track
        self._couple(track)
        rates = np.zeros(LINES + SLOTS)
        rates[4:6] = track.rates
        self._filter.set_path(LINES + track.slot, measured.offset, stamp, rates, track.deviation)
        track.offset = float(self._filter.state[LINES + track.slot])
        return track

    def _couple(self, track: TrackedLine) -> None:
        """Couple the offset to the velocity: it falls as the tip moves along the line's normal."""
        track.rates = -math.cos(track.angle), -math.sin(track.angle)
        self._filter.chain[LINES + track.slot, 0:2] = track.rates

    def _drop(self, track: TrackedLine) -> None:
        entry = LINES + track.slot
        del self.lines[track.track_id]
        self._filter.chain[entry, :] = 0.0
        self._filter.set_entry(entry, 0.0, UNUSED_STD)
