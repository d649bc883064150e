"""Faults of perception: lines or plane missing, wrong, or not finite; they need geometric features."""

from __future__ import annotations

import dataclasses
import math
from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import choice, setting
from ibvs_qp.measurement import FeatureFrame, LineFeature, SensorFrame
from sim.faults.fault import FrameFilter, SensorFault

#: Fields of a feature frame, and of its lines, that `FeatureNan` can break.
OF_FRAME, OF_LINE = ("plane", "velocity", "velocity_covariance"), ("rho", "theta", "covariance")


@dataclass(frozen=True, kw_only=True)
class FeatureFault(SensorFault):
    """A fault of the result of perception for a picture."""

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """Change the features of every picture."""

        def changed(frame: SensorFrame) -> SensorFrame:
            if frame.image is not None:
                raise ConfigError(f"{self.words}: fly it with --features geometric")
            if frame.features is None:
                return frame
            return dataclasses.replace(frame, features=self.spoilt(frame.features, rng))

        return changed

    @abstractmethod
    def spoilt(self, features: FeatureFrame, rng: np.random.Generator) -> FeatureFrame:
        """Result of perception with the fault."""


@dataclass(frozen=True, kw_only=True)
class PlaneLost(FeatureFault):
    """No plane: depth is lost."""

    def spoilt(self, features: FeatureFrame, rng: np.random.Generator) -> FeatureFrame:
        """Without a plane."""
        return dataclasses.replace(features, plane=None)


@dataclass(frozen=True, kw_only=True)
class LinesLost(FeatureFault):
    """No lines, or each one only now and then, or none of a kind."""

    share: float = setting(1.0, "fraction of the lines that is lost, drawn for every line and picture", low=0, high=1)
    kind_of_line: str = choice("", "only board edges or edges of paint; empty: of all kinds", ("", "board", "paint"))

    def spoilt(self, features: FeatureFrame, rng: np.random.Generator) -> FeatureFrame:
        """Without those lines."""
        lost = rng.random(len(features.lines)) < self.share
        return dataclasses.replace(
            features,
            lines=tuple(
                line
                for line, gone in zip(features.lines, lost, strict=True)
                if not gone or self.kind_of_line not in ("", line.kind)
            ),
        )


@dataclass(frozen=True, kw_only=True)
class WrongLines(FeatureFault):
    """Some lines are far from where they should be, with the covariance of good ones."""

    share: float = setting(0.3, "fraction of the lines that is wrong, drawn for every line and picture", low=0, high=1)
    rho: float = setting(0.2, "largest error of rho, uniform in both directions", low=0.0, high=2.0)
    theta_deg: float = setting(20.0, "largest error of theta, likewise", unit="deg", low=0.0, high=180.0)

    def spoilt(self, features: FeatureFrame, rng: np.random.Generator) -> FeatureFrame:
        """With those lines moved."""

        def moved(line: LineFeature) -> LineFeature:
            wrong, aside, turn = rng.random() < self.share, *rng.uniform(-1.0, 1.0, 2).tolist()
            if not wrong:
                return line
            turned = line.theta + math.radians(self.theta_deg) * turn
            return dataclasses.replace(line, rho=line.rho + self.rho * aside, theta=turned)

        return dataclasses.replace(features, lines=tuple(moved(line) for line in features.lines))


@dataclass(frozen=True, kw_only=True)
class DepthFlipped(FeatureFault):
    """The plane's normal is mirrored left to right and up to down, or the plane lies behind the camera."""

    what: str = choice("normal", "flipped parts", ("normal", "sign"))

    def spoilt(self, features: FeatureFrame, rng: np.random.Generator) -> FeatureFrame:
        """With the flipped plane."""
        if features.plane is None:
            return features
        a, b, c, d = features.plane
        plane = (-a, -b, c, d) if self.what == "normal" else (-a, -b, -c, d)
        return dataclasses.replace(features, plane=plane)


@dataclass(frozen=True, kw_only=True)
class FeatureNan(FeatureFault):
    """One field is not a number: in all pictures of the fault, or in the first one."""

    field: str = choice("plane", "the field; those of lines in every line", (*OF_FRAME, *OF_LINE))
    once: bool = setting(True, "in one picture only")

    def filter(self, rng: np.random.Generator) -> FrameFilter:
        """As all, except for one picture."""
        every, spoilt = super().filter(rng), []

        def first(frame: SensorFrame) -> SensorFrame | None:
            if self.once and spoilt:
                return frame
            spoilt.extend([] if frame.features is None else [frame])
            return every(frame)

        return first

    def spoilt(self, features: FeatureFrame, rng: np.random.Generator) -> FeatureFrame:
        """With NaN in the field."""
        bad = {
            "plane": (math.nan, math.nan, math.nan, -1.0),
            "velocity": np.full(3, math.nan),
            "velocity_covariance": np.full((3, 3), math.nan),
            "covariance": np.full((2, 2), math.nan),
        }.get(self.field, math.nan)
        if self.field in OF_FRAME:
            return dataclasses.replace(features, **{self.field: bad})
        return dataclasses.replace(
            features, lines=tuple(dataclasses.replace(line, **{self.field: bad}) for line in features.lines)
        )
