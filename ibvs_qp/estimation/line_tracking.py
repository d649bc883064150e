"""Correction of one tracked line: noise, offset and angle of a line on the wall, as noisy as its frames show."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca

from ibvs_qp.config import EstimationConfig
from ibvs_qp.estimation.kalman import LateKalman
from ibvs_qp.estimation.noise import WhiteNoise
from ibvs_qp.estimation.wall_lines import MeasuredLine
from ibvs_qp.symbolic.logic import both, either, no, where
from ibvs_qp.symbolic.signals import Signals

#: Lines tracked at once, and where their offsets begin in the state of the motion: after velocity, bias and odometer.
SLOTS, LINES = 8, 6


class LineRecord(NamedTuple):
    """Memory of a line."""

    variance: ca.SX  # noise of the offset (`WhiteNoise`) [m^2]
    samples: ca.SX
    residual: ca.SX
    angle: ca.SX  # filtered [rad]; the angle changes little
    spread: ca.SX  # its variance [rad^2]
    angle_variance: ca.SX  # noise of the angle [rad^2]
    angle_samples: ca.SX
    angle_residual: ca.SX
    frames: ca.SX  # that showed the line
    refused: ca.SX  # refused offsets in a row that agree with each other
    right: ca.SX  # change of the offset per metre of tip motion to the right [-]
    down: ca.SX  # and down [-]
    walk: ca.SX  # spectral density of the offset's random walk [m^2/s]


class LineInput(NamedTuple):
    """One line of a frame."""

    known: ca.SX  # whether there is one
    slot: ca.SX  # its place, a vector with a one, (SLOTS,)
    new: ca.SX  # whether its track starts
    seen_s: ca.SX  # time since the frame that showed it before [s]
    variance: ca.SX  # of rho
    paint: ca.SX  # whether it is a painted edge
    measured: MeasuredLine  # on the wall


class LineCorrection(NamedTuple):
    """Result for one line."""

    accepted: ca.SX  # whether the line starts or is corrected
    ends: ca.SX  # whether its track ends, because another line stays in its place
    change: ca.SX  # of the state of the motion at the capture
    record: LineRecord
    deviation: ca.SX  # of the offset [m]


class LineRecords:
    """Records of all slots, and the noise of all lines, which is the prior of a new one."""

    def __init__(self, signals: Signals) -> None:
        self._signals = signals
        count = len(LineRecord._fields)
        self._records = ca.reshape(signals.state("lines.records", count * SLOTS), count, SLOTS)
        self.offset_noise, self.angle_noise = (
            WhiteNoise(signals.state(f"lines.{name}_variance"), signals.state(f"lines.{name}_samples"), ca.SX(0.0))
            for name in ("offset", "angle")
        )

    @property
    def rates(self) -> ca.SX:
        """Change of every offset per metre of tip motion to the right and down, (SLOTS, 2)."""
        first = LineRecord._fields.index("right")
        return self._records[first : first + 2, :].T

    @property
    def walks(self) -> list[ca.SX]:
        """Spectral densities of the offsets' random walks [m^2/s]."""
        return ca.horzsplit(self._records[LineRecord._fields.index("walk"), :])

    def at(self, slot: ca.SX) -> LineRecord:
        """Record of one slot, given as a vector with a one."""
        return LineRecord(*ca.vertsplit(self._records @ slot))

    def store(self, slot: ca.SX, record: LineRecord) -> None:
        """Remember a record, and the noise of all lines."""
        new = ca.vertcat(*record)
        columns = [
            where(here, new, old) for here, old in zip(ca.vertsplit(slot), ca.horzsplit(self._records), strict=True)
        ]
        self._signals.remember("lines.records", ca.vertcat(*columns))
        for name, noise in (("offset", self.offset_noise), ("angle", self.angle_noise)):
            self._signals.remember(f"lines.{name}_variance", noise.variance)
            self._signals.remember(f"lines.{name}_samples", noise.samples)


def correct_line(
    records: LineRecords,
    kalman: LateKalman,
    config: EstimationConfig,
    line: LineInput,
    past: ca.SX,
    age: ca.SX,
    other: ca.SX,
) -> LineCorrection:
    """Correct the filter of the motion with one line, or start its track.

    Args:
        records: Records of all lines.
        kalman: Filter of the motion in the wall plane.
        config: Noise models and bounds.
        line: The line.
        past: State at its capture; its own offset there counts once the track has started.
        age: Time since the capture [s].
        other: Whether there is another measurement of that time instead of the line.
    """
    measured, old = line.measured, records.at(line.slot)
    entry = ca.vertcat(ca.SX.zeros(LINES), line.slot)
    known = both(line.known, measured.known)
    tracked, starts = both(known, no(line.new)), both(known, line.new)
    claimed = config.line_std_m**2 + ca.fmax(line.variance, 0.0) * measured.scale**2

    noise = WhiteNoise(old.variance, old.samples, old.residual)
    innovation = measured.offset - ca.dot(entry, past)
    difference = innovation - noise.residual
    sample = noise.sample(difference, claimed)
    prior = records.offset_noise.like(measured.scale**2)
    records.offset_noise = records.offset_noise.averaged(sample / measured.scale**2, tracked)
    noise = noise.averaged(sample)
    variance = noise.total(claimed)
    # Never below the variance of the mean: the first frames get no more confidence than they deserve.
    least = variance / ca.fmax(old.frames, 1.0)
    kalman.raise_variance(entry, where(tracked, least, 0.0))
    kalman.go_to(either(tracked, other), age)
    accepted = both(tracked, kalman.within(entry, innovation, variance, config.gate_sigmas))
    change = kalman.correct(accepted, entry, innovation, variance)

    # The angle, a random walk. The fit's own variance is not used: on a short fresh edge it is three times too large.
    tilt = WhiteNoise(old.angle_variance, old.angle_samples, old.angle_residual)
    angle_prior, angle_claimed = records.angle_noise.like(), config.angle_std_rad**2
    turn = measured.angle - old.angle
    sample = tilt.sample(turn - tilt.residual, angle_claimed)
    records.angle_noise = records.angle_noise.averaged(sample, accepted)
    tilt = tilt.averaged(sample)
    angle_noise = tilt.total(angle_claimed)
    spread = ca.fmax(old.spread + config.angle_noise**2 * line.seen_s, angle_noise / ca.fmax(old.frames, 1.0))
    gain = spread / (spread + angle_noise)

    first_variance, passed = prior.total(claimed), either(starts, accepted)
    kalman.set_entry(starts, entry, ca.sqrt(first_variance))
    angle = where(starts, measured.angle, old.angle + gain * turn)
    walk = where(line.paint, config.paint_noise**2, config.line_noise**2)  # a painted edge swings ahead of the brush
    started = LineRecord(
        variance=prior.variance,
        samples=prior.samples,
        residual=ca.SX(0.0),
        angle=angle,
        spread=angle_prior.total(angle_claimed),
        angle_variance=angle_prior.variance,
        angle_samples=angle_prior.samples,
        angle_residual=ca.SX(0.0),
        frames=ca.SX(1.0),
        refused=ca.SX(0.0),
        right=-ca.cos(angle),
        down=-ca.sin(angle),
        walk=walk,
    )
    corrected = started._replace(
        variance=noise.variance,
        samples=noise.samples,
        residual=innovation - ca.dot(entry, change),
        spread=spread * (1.0 - gain),
        angle_variance=tilt.variance,
        angle_samples=tilt.samples,
        angle_residual=(1.0 - gain) * turn,
        frames=old.frames + 1.0,
    )
    refused = old._replace(
        variance=noise.variance,
        samples=noise.samples,
        residual=innovation,
        # New noise scatters, so its offsets are only refused until it is learned. Those of another line agree.
        refused=where(difference * difference < 2.0 * config.gate_sigmas**2 * variance, old.refused + 1.0, 1.0),
    )
    record = _choose(starts, started, _choose(accepted, corrected, _choose(tracked, refused, old)))
    records.store(line.slot, record)
    deviation = ca.sqrt(where(starts, first_variance, kalman.variance_of(entry)))
    ends = both(tracked, no(accepted), record.refused >= config.refused_frames)
    return LineCorrection(passed, ends, change, record, deviation)


def _choose(condition: ca.SX, then: LineRecord, otherwise: LineRecord) -> LineRecord:
    return LineRecord(*(where(condition, first, other) for first, other in zip(then, otherwise, strict=True)))
