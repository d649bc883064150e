"""Noise learned from successive measurements, and the filters that rest on it: told nothing, consistent."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import TICK_NS, Wall, attitude
from estimators import PlaneMotion
from symbolic_block import Block

from ibvs_qp.config import EstimationConfig
from ibvs_qp.estimation.line_tracking import LineRecord
from ibvs_qp.estimation.noise import WINDOW, WhiteNoise
from ibvs_qp.estimation.wall_lines import WallAxes
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, FeatureFrame, LineFeature

TICK, DEPTH, LATE = 0.004, 0.50, 15
SIGMAS = (0.02, 0.08, 0.12)
WALL = Wall(attitude(), 0.0)
CONFIG = EstimationConfig()


class Row:
    """A tip that slides left at 0.1 m/s past a level edge and towards an upright one, seen 60 ms late at 30 Hz."""

    def __init__(self, sigma: float, seed: int = 0, slope: float = 0.0, flip: bool = False) -> None:
        self.motion = PlaneMotion()
        self.axes = WallAxes.of(WALL.normal.tolist(), WALL.gravity.tolist())
        self.sigma, self.slope, self.flip = sigma, slope, flip
        self.rng, self.tick, self.pictures = np.random.default_rng(seed), 0, 0
        self.jump = 0.0

    def right(self, tick: int) -> float:
        """Path of the tip: still for a second, then 0.1 m/s to the left."""
        return -0.1 * max(0.0, tick * TICK - 1.0)

    def offset(self, role: str, tick: int) -> float:
        """Where a line is: a level edge 5 cm below the start, an upright one 60 cm left of it."""
        if role == VERTICAL:
            return -0.6 - self.right(tick)
        return (0.05 + self.jump) * math.cos(self.slope) + math.sin(self.slope) * self.right(tick)

    def picture(self, then: int) -> FeatureFrame:
        """Lines with noise on rho and theta that their covariance says nothing about."""
        lines = []
        for identity, role in enumerate((HORIZONTAL, VERTICAL), start=1):
            tilt = self.slope + 0.5 * math.pi if role == HORIZONTAL else 0.0
            line = WALL.line(
                self.offset(role, then), tilt, role, covariance=np.eye(2) * 1e-8, track_id=identity, flip=self.flip
            )
            rho, theta = np.array((line.rho, line.theta)) + self.sigma * self.rng.standard_normal(2)
            lines.append(replace(line, rho=float(rho), theta=float(theta)))
        speed = (self.right(then + 1) - self.right(then - 1)) / (2 * TICK)
        velocity = np.array(self.axes.right) * speed + self.rng.normal(0.0, 3e-3, 3)
        return FeatureFrame(
            lines=tuple(lines),
            plane=WALL.plane,
            stamp_ns=then * TICK_NS,
            velocity=velocity,
            velocity_covariance=np.eye(3) * 9e-6,
        )

    def record(self, name: str) -> float:
        """What the filter remembers of the level line."""
        place = len(LineRecord._fields) * self.motion.lines[1].slot + LineRecord._fields.index(name)
        return self.motion._step.states["lines.records"][place]

    def fly(self, seconds: float) -> np.ndarray:
        """Errors and claimed deviations of the level line's offset after every picture [m], (k, 2)."""
        found = []
        for _ in range(round(seconds / TICK)):
            here, ahead = self.right(self.tick), self.right(self.tick + 1)
            gain = (ahead - 2 * here + self.right(self.tick - 1)) / TICK**2 if self.tick else 0.0
            self.tick += 1
            self.motion.predict(self.tick * TICK_NS, self.axes, (0.0, gain, -9.81), (0.0, 0.0, 0.0), TICK, 0.0)
            if self.tick % 8 == 0 and self.tick > LATE:
                self.motion.see(self.picture(self.tick - LATE), self.axes, 0.0)
                self.pictures += 1
            if self.tick % 8 == 1 and 1 in self.motion.lines:
                line = self.motion.lines[1]
                found.append((line.offset - self.offset(HORIZONTAL, self.tick), line.deviation))
        return np.array(found)


# ----------------------------------------------------------------------------------------------- noise of a series


def learned(innovations: np.ndarray) -> np.ndarray:
    """Variances found in a series that no filter follows."""

    def build(signals):
        states = [signals.state(name) for name in WhiteNoise._fields]
        innovation, noise = signals.input("innovation"), WhiteNoise(*states)
        noise = noise.averaged(noise.sample(innovation - noise.residual, 1e-8))._replace(residual=innovation)
        for name, value in zip(WhiteNoise._fields, noise, strict=True):
            signals.remember(name, value)
        return noise.variance

    block = Block(build)
    return np.array([block(innovation=innovation)[0] for innovation in innovations])


@pytest.mark.parametrize("sigma", [1e-3, 1e-2, 6e-2])
def test_the_noise_is_found_while_the_filter_drifts(sigma: float) -> None:
    """White noise on a steady drift that the filter does not follow at all: the drift is not taken for noise."""
    rng = np.random.default_rng(1)
    found = learned(0.2 * sigma * np.arange(600) + sigma * rng.standard_normal(600))
    assert math.sqrt(np.mean(found[WINDOW:])) == pytest.approx(sigma, rel=0.1)


def test_one_leap_is_not_taken_for_noise() -> None:
    found = learned(1.0 * (np.arange(200) >= 150) + 1e-3 * np.random.default_rng(2).standard_normal(200))
    assert math.sqrt(found[150]) < 2e-3 and math.sqrt(found[-1]) < 1.5e-3


# -------------------------------------------------------------------------------------------------- lines on a wall


@pytest.mark.parametrize("sigma", SIGMAS)
def test_the_filter_finds_sigma_and_is_consistent(sigma: float) -> None:
    """Error^2 over claimed variance is near one, gates let the noise through, and the line stays itself."""
    ratios, errors = [], []
    for seed in range(6):
        row = Row(sigma, seed)
        row.fly(1.5)
        found = row.fly(3.5)
        line = row.motion.lines[1]
        assert line.frames == row.pictures  # never refused, never begun anew
        assert math.sqrt(row.record("variance")) == pytest.approx(sigma * DEPTH, rel=0.5)
        assert math.sqrt(row.record("angle_variance")) == pytest.approx(sigma, rel=0.5)
        errors.append(found[:, 0])
        ratios.append(np.mean((found[:, 0] / found[:, 1]) ** 2))
    spread = float(np.sqrt(np.mean(np.square(errors))))
    print(f"sigma_vs {sigma}: offset within {spread * 1e3:.1f} mm, error^2/variance {np.mean(ratios):.2f}")
    assert spread < {0.02: 2.5e-3, 0.08: 8e-3, 0.12: 1.1e-2}[sigma]
    assert 0.3 < np.mean(ratios) < 2.5


def test_clean_pictures_pass_as_before() -> None:
    """Without extra noise the deviation stays the configured one and the line no lag worth one."""
    row = Row(0.0)
    row.fly(1.5)
    found = row.fly(3.0)
    assert np.abs(found[:, 0]).max() < CONFIG.line_std_m
    assert row.record("variance") < CONFIG.line_std_m**2
    spread = row.motion.lines[1].theta_variance
    gain = 1.0 - spread / (spread + CONFIG.angle_noise**2 / 30.0)
    assert gain > 0.1  # a clean angle is followed within a quarter of a second


def test_noise_that_begins_in_flight_is_learned_and_the_good_estimate_kept() -> None:
    row = Row(0.0)
    row.fly(2.0)
    row.sigma = 0.08
    found = row.fly(2.0)
    assert np.abs(found[:, 0]).max() < 6e-3
    assert row.motion.lines[1].frames > 40 and math.sqrt(row.record("variance")) > 0.02


def test_a_real_leap_under_noise_is_a_new_line() -> None:
    """Thirty standard deviations aside and staying there: the line is begun anew, not averaged across."""
    row = Row(0.002)
    row.fly(2.0)
    row.jump = 0.03
    row.fly(0.3)
    line = row.motion.lines[1]
    assert line.frames < 12 and abs(line.offset - row.offset(HORIZONTAL, row.tick)) < 3e-3


@pytest.mark.parametrize("slope", [-0.05, 0.05])
@pytest.mark.parametrize("sigma", [0.0, 0.12])
def test_both_ways_of_writing_a_line_on_both_sides_of_the_seam_are_one(slope: float, sigma: float) -> None:
    """(rho, theta) and (-rho, theta + pi); a level line lies on the seam of theta, and noise throws it across."""
    results = []
    for flip in (False, True):
        row = Row(sigma, seed=3, slope=slope)
        picture = row.picture

        def written(then: int, flip: bool = flip, picture=picture) -> FeatureFrame:
            frame = picture(then)
            return replace(frame, lines=tuple(_other(line) if flip else line for line in frame.lines))

        row.picture = written
        row.fly(3.0)
        line = row.motion.lines[1]
        results.append((line.offset, line.angle, line.deviation))
        assert line.angle - 0.5 * math.pi == pytest.approx(slope, abs=0.002 if sigma == 0.0 else 0.04)
    np.testing.assert_allclose(results[0], results[1], atol=1e-9)


def _other(line: LineFeature) -> LineFeature:
    return replace(line, rho=-line.rho, theta=line.theta - math.pi, surface_side=-line.surface_side)
