"""Recorded inputs with one broken field now and then, so that the checks have something to refuse."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ibvs_qp import FeatureFrame, LineFeature, LineReference

from .recordings import Recording

#: The first broken tick, and ticks from one to the next.
FIRST, GAP = 100, 41
_NAN = np.full(3, math.nan)
_EARLIER_NS = 1_000_000_000

_LINE = LineFeature(rho=0.1, theta=1.5, covariance=1e-6 * np.eye(2), role="horizontal")
_WANTED = LineReference(rho=0.1, theta=1.5, role="horizontal")

_FRAMES: tuple[dict[str, Any], ...] = (
    {"attitude": np.full(4, math.nan)},
    {"attitude": np.array([1.0, 0.5, 0.0, 0.0])},
    {"angular_velocity": np.full(3, 1e3)},
    {"specific_force": np.zeros(2)},
    {"wrench": np.full(6, math.inf)},
    {"wrench": None},
    {"wrench_stamp_ns": 1 << 60},
    {"features": FeatureFrame(lines=(), plane=None, stamp_ns=-1)},
    {"features": FeatureFrame(lines=(replace(_LINE, rho=math.nan),), plane=(0.0, math.nan, 2.0, -1.0), stamp_ns=1)},
    {"stamp_ns": 0.5},
    {"stamp_ns": -1},
)
_MEASUREMENTS: tuple[dict[str, Any], ...] = (
    {"attitude": np.full(4, math.nan)},
    {"attitude": np.array([1.0, 0.5, 0.0, 0.0])},
    {"angular_velocity": _NAN},
    {"angular_velocity": np.full(3, 1e3)},
    {"specific_force": np.zeros(2)},
    {"contact_wrench": np.full(6, math.nan)},
    {"contact_wrench": np.full(6, 1e6)},
    {"wrench_stamp_ns": 1 << 60},
    {"wrench_stamp_ns": 1},
    {"lines": (replace(_LINE, rho=math.nan),)},
    {"lines": (replace(_LINE, covariance=-np.eye(2)),)},
    {"lines": (replace(_LINE, role="oblique"),)},
    {"lines": (replace(_LINE, weight=2.0),)},
    {"lines": (replace(_LINE, stamp_ns=1 << 60),)},
    {"lines": None},
    {"plane": (0.0, math.nan, 2.0, -1.0)},
    {"plane": (0.0, 0.0, 2.0, 1.0)},
    {"plane_stamp_ns": 1 << 60},
    {"velocity": _NAN},
    {"velocity": np.full(3, 100.0)},
    {"velocity_covariance": -np.eye(3)},
    {"thrust_max": np.zeros(2)},
    {"thrust_min": np.full(6, 60.0), "thrust_max": np.full(6, 10.0)},
    {"stamp_ns": 0.5},
    {"stamp_ns": -1},
)
_REFERENCES: tuple[dict[str, Any], ...] = (
    {"push_force": math.nan},
    {"push_force": -1.0},
    {"push_force": 45.0, "contact": True},
    {"standoff": math.nan},
    {"standoff": "near"},
    {"lines": (replace(_WANTED, rho=math.nan),)},
    {"lines": (_WANTED,) * 9},
    {"lines": (replace(_WANTED, role="oblique"),)},
    {"velocity": np.zeros(3)},
    {"velocity": np.full(2, 50.0)},
    {"tilt": np.full(2, 3.0)},
    {"travel": np.full(2, math.nan)},
    {"contact": None},
)


def broken(recording: Recording) -> Recording:
    """The recording with broken fields; also the same stamp twice and one that runs back, at the very end."""
    frames, measurements, references = (
        list(inputs) for inputs in (recording.frames, recording.measurements, recording.references)
    )
    for index, tick in enumerate(range(FIRST, len(frames), GAP)):
        frames[tick] = replace(frames[tick], **_FRAMES[index % len(_FRAMES)])
        measurements[tick] = replace(measurements[tick], **_MEASUREMENTS[index % len(_MEASUREMENTS)])
        other = tick + GAP // 2
        if other < len(references):
            references[other] = replace(references[other], **_REFERENCES[index % len(_REFERENCES)])
    for tick, back_ns in ((-12, _EARLIER_NS), (-7, 0)):
        stamp = frames[tick - 1].stamp_ns - back_ns
        frames[tick] = replace(frames[tick], stamp_ns=stamp)
        measurements[tick] = replace(measurements[tick], stamp_ns=stamp)
    return Recording(frames, recording.thrust_limits, measurements, references)
