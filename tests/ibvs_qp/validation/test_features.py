"""Results of perception: nothing unsound reaches a filter, and every drop is named."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ibvs_qp.measurement import FeatureFrame, LineFeature
from ibvs_qp.validation.features import check_features

MOST = 4
LINE = LineFeature(
    rho=0.1, theta=1.5, covariance=1e-6 * np.eye(2), role="horizontal", kind="board", surface_side=1, track_id=7
)
GOOD = FeatureFrame(
    lines=(LINE, replace(LINE, track_id=1)),
    plane=(0.0, 0.1, 2.0, -1.0),
    stamp_ns=9,
    velocity=np.array([0.1, 0.0, 0.2]),
    velocity_covariance=np.diag([1e-4, 1e-4, 1e3]),
)


def checked(features: FeatureFrame) -> tuple[FeatureFrame, list[str]]:
    rejected: list[str] = []
    return check_features(features, MOST, rejected), rejected


def test_curvature_passes_within_its_bound() -> None:
    curved = np.array([0.6, 0.1, -0.3])
    found, rejected = checked(replace(GOOD, curvature=curved))
    assert rejected == [] and np.array_equal(found.curvature, curved) and found.curvature is not curved
    for bad in (np.array([math.nan, 0.0, 0.0]), np.array([3.0, 0.0, 0.0]), np.zeros(2)):
        found, rejected = checked(replace(GOOD, curvature=bad))
        assert found.curvature is None and "curvature" in rejected[0] and found.plane == GOOD.plane


def test_sound_features_pass_and_are_copies() -> None:
    found, rejected = checked(GOOD)
    assert rejected == [] and found.lines == GOOD.lines and found.plane == GOOD.plane
    for name in ("velocity", "velocity_covariance"):
        assert np.array_equal(getattr(found, name), getattr(GOOD, name))
        assert not np.shares_memory(getattr(found, name), getattr(GOOD, name))
    plane, velocity = np.array(GOOD.plane), [0, 1, 2]
    found, rejected = checked(replace(GOOD, plane=plane, velocity=velocity, lines=list(GOOD.lines)))  # type: ignore[arg-type]
    plane[:] = math.nan
    assert rejected == [] and found.plane == GOOD.plane and found.lines == GOOD.lines
    assert found.velocity is not None and found.velocity.tolist() == velocity


BAD_LINES: list[dict[str, Any]] = [
    *[
        {name: value}
        for name in ("rho", "theta", "weight")
        for value in (math.nan, math.inf, 1e300, None, "0", 10**400)
    ],
    *[{"covariance": value} for value in (None, -np.eye(2), np.full((2, 2), math.nan), [[1, 0], [0]], np.eye(3))],
    *[{"covariance": np.array(value)} for value in ([[-1.0, 0], [0, 1]], [[1.0, 0], [0, -1]], [[1, math.nan], [0, 1]])],
    *[{"segment": value} for value in (1e300, "ends", np.zeros(4), np.full((2, 2), math.nan), [[0, 0], [0, math.inf]])],
    *[{"track_id": value} for value in ([], 2**63)],
    *[{"role": "oblique"}, {"role": ["horizontal"]}, {"surface_side": 3}, {"kind": None}],
]


@pytest.mark.parametrize("bad", BAD_LINES)
def test_a_bad_line_is_dropped_alone(bad: dict[str, Any]) -> None:
    found, rejected = checked(replace(GOOD, lines=(replace(LINE, **bad), LINE)))
    assert found.lines == (LINE,) and found.plane == GOOD.plane and found.velocity is not None
    assert rejected == ["features.lines: 1 malformed, not finite or of unknown role"]


def test_ends_of_a_line_given_as_a_list_are_kept() -> None:
    ends = [[-0.1, 0.2], [0.1, 0.2]]
    found, rejected = checked(replace(GOOD, lines=(replace(LINE, segment=ends, rho=0),)))
    assert rejected == [] and found.lines[0].segment is not None
    assert found.lines[0].segment.tolist() == ends


def test_lines_without_an_identity_get_one_by_role_and_order() -> None:
    roles = ("horizontal", "vertical", "horizontal", "vertical")
    found, rejected = checked(replace(GOOD, lines=tuple(replace(LINE, role=role, track_id=0) for role in roles)))
    assert [line.track_id for line in found.lines] == [-2, -3, -4, -5] and rejected == []
    alone, _ = checked(replace(GOOD, lines=(replace(LINE, role="vertical", track_id=0),)))
    assert alone.lines[0].track_id == -3, "the same in every frame"


@pytest.mark.parametrize("track_id", [-1, -2, 1 - 2**63])
def test_a_negative_identity_is_refused_and_displaces_no_line_without_one(track_id: int) -> None:
    """Trackers mark an unknown line by -1; -2 is that of the first horizontal line without an identity."""
    found, rejected = checked(replace(GOOD, lines=(replace(LINE, track_id=track_id), replace(LINE, track_id=0))))
    assert [line.track_id for line in found.lines] == [-2]
    assert rejected == ["features.lines: 1 with a negative track_id"]


def test_of_two_lines_with_one_identity_the_second_is_dropped() -> None:
    found, rejected = checked(replace(GOOD, lines=(LINE, replace(LINE, rho=0.2))))
    assert found.lines == (LINE,) and rejected == ["features.lines: 1 with a track_id of another line"]


@pytest.mark.parametrize("lines", [None, 5, "lines", {1: LINE}, np.zeros(3), iter([LINE])])
def test_what_are_no_lines(lines: Any) -> None:
    found, rejected = checked(replace(GOOD, lines=lines))
    assert found.lines == () and rejected == ["features.lines: not a tuple of lines"]


@pytest.mark.parametrize(
    "plane",
    [
        *[(0.0, 0.0, 2.0, 0.0), (0.0, 0.0, 0.0, -1.0), (0.0, 0.0, -2.0, -1.0), (0.0, math.nan, 2.0, -1.0)],
        *[(1e6, 0.0, 2.0, -1.0), (0.0, 0.0, math.inf, -1.0), (0.0, 0.0, 2.0), [0.0] * 10**6, "abcd", np.zeros((4, 9))],
        *[(0.0, 0.0, 10**400, -1.0), np.ma.array([0.0, 0.0, 2.0, -1.0]), (0.0, 0.0, -2.0, True), np.array(2.0)],
    ],
)
def test_a_bad_plane_is_dropped_alone(plane: Any) -> None:
    found, rejected = checked(replace(GOOD, plane=plane))
    assert found.plane is None and found.lines == GOOD.lines and found.velocity is not None
    assert rejected == ["features.plane: not 4 finite values with D != 0 in front of the camera"]


@pytest.mark.parametrize(
    ("distance", "accepted"), [(19.0, True), (21.0, False), (1e9, False), (0.0011, True), (9e-4, False)]
)
def test_a_plane_farther_than_any_depth_camera_sees_is_dropped(distance: float, accepted: bool) -> None:
    found, rejected = checked(replace(GOOD, plane=(0.0, 0.0, 1.0 / distance, -1.0)))
    assert (found.plane is not None) == accepted == (not rejected)


@pytest.mark.parametrize(
    "velocity", [np.full(3, math.nan), np.full(3, 25.0), np.zeros(2), "fast", 1.0, [0.0, 0.0, None]]
)
def test_a_bad_velocity_is_dropped_alone(velocity: Any) -> None:
    found, rejected = checked(replace(GOOD, velocity=velocity))
    assert found.velocity is None and found.velocity_covariance is None and found.lines == GOOD.lines
    assert len(rejected) == 1 and rejected[0].startswith("features.velocity: ")


@pytest.mark.parametrize(
    "covariance",
    [
        *[None, 1.0, np.eye(2), np.full((3, 3), math.nan), -np.eye(3), np.diag([1.0, 1.0, -1e-3]), np.eye(3) * 1e13],
        *[np.ones((3, 3)) + np.triu(np.ones((3, 3))), np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]])],
    ],
)
def test_a_velocity_without_a_covariance_is_dropped(covariance: Any) -> None:
    found, rejected = checked(replace(GOOD, velocity_covariance=covariance))
    assert found.velocity is None and found.lines == GOOD.lines
    assert rejected == ["features.velocity_covariance: not 3 x 3, finite, symmetric and without negative variance"]


def test_of_many_lines_a_few_are_looked_at() -> None:
    lines = tuple(replace(LINE, track_id=number + 1) for number in range(2 * MOST))
    found, rejected = checked(replace(GOOD, lines=lines * (10**6 // len(lines))))
    count = len(found.lines)  # a million lines in a message take minutes
    assert count == MOST
    assert found.lines == lines[:MOST]
    assert rejected == [f"features.lines: 1000000 given, only the first {MOST} are looked at"]
