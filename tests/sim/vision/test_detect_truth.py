"""The detector of `ibvs-qp detect` on rendered frames with exact truth: found, exact, never wrong and sure."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from ibvs_qp.frames import align_line
from ibvs_qp.vision.lines.refine import RefinedLine
from ibvs_qp.vision.lines.tracks import TrackState
from ibvs_qp.vision.perception import GuideKeeper
from sim.detection.own import OwnMethod
from tests.support.truth import FAMILIES, TruthScene, Variation, render_frame, sample_scene
from tests.support.truth.accuracy import Errors, line_errors, measure_family
from tests.support.truth.scenes import turned

#: Families in which every edge must be found; the others ask for edges that colour alone can show, or are of devices
#: (tests/sim/detection/truth/test_devices.py).
CLEAR = [name for name in FAMILIES if name not in ("hard", "thin board") and FAMILIES[name].base.device is None]


def run(family: str, count: int, first: int = 0) -> Errors:
    scenes = [sample_scene(FAMILIES[family], first + k) for k in range(count)]
    return measure_family(scenes, lambda truth: OwnMethod().detect(truth.frame, truth.seed))


@pytest.mark.slow
def test_edges_are_found_to_a_fraction_of_a_pixel() -> None:
    total = Errors()
    for family in CLEAR:
        errors = run(family, 20)
        assert not any(confidence >= 0.8 for confidence in errors.wrong), (family, errors.wrong)
        assert not errors.refused, errors.refused
        total.pool(errors)
    assert total.found >= 0.99, total.missed
    assert np.median(total.offset_px) <= 0.05 and np.percentile(total.offset_px, 95) <= 0.3
    assert np.median(total.angle_deg) <= 0.01 and np.percentile(total.angle_deg, 95) <= 0.05
    assert np.median(total.chi_square) < 6.0, "covariance claims more than is true (1.4 expected)"


@pytest.mark.slow
@pytest.mark.parametrize("family", ["hard", "thin board"])
def test_what_depth_cannot_tell_is_never_wrong_and_sure(family: str) -> None:
    errors = run(family, 3)
    assert not any(confidence >= 0.8 for confidence in errors.wrong), errors.wrong
    assert errors.offset_px, "colour shows some of the edges"


# a joint of the wall runs 4 px beside the top edge, half as long
def test_a_joint_beside_the_edge_makes_it_no_nested_border() -> None:
    errors = run("printed", 1, 10)
    assert errors.found == 1.0 and not errors.wrong


def test_roll_through_every_seam_without_an_error_jump() -> None:
    base, worst = TruthScene(size_m=(0.5, 0.42)), 0.0
    for degrees in range(-180, 181, 40):
        scene = dataclasses.replace(base, rotation=turned(math.radians(degrees + 0.4), 0.05, 0.04), seed=4)
        truth = render_frame(scene)
        result = OwnMethod().detect(truth.frame, truth.seed)
        assert result.refused is None
        for edge in truth.edges.values():
            nearest = min(
                result.candidates, key=lambda line: line_errors(edge, line.rho, line.theta, scene.intrinsics)[2]
            )
            errors = line_errors(edge, nearest.rho, nearest.theta, scene.intrinsics)
            worst = max(worst, errors[2])
            rho, theta = align_line(edge.rho, edge.theta, nearest.theta)
            assert abs(nearest.rho - rho) < 1e-3 and abs(nearest.theta - theta) < 2e-3, degrees
    assert worst < 1.0


def test_truth_is_consistent_with_its_own_depth() -> None:
    truth = render_frame(sample_scene(Variation(base=TruthScene(depth_noise=0.0)), 5))
    fx, fy, cx, cy = truth.frame.intrinsics
    u, v = truth.seed
    a, b, c = truth.plane
    z = truth.frame.depth[round(v), round(u)]
    assert z * (a * (round(u) - cx) / fx + b * (round(v) - cy) / fy + c) == pytest.approx(1.0, abs=0.01)
    edge = truth.edges["top"]
    x, y = ((edge.pixels - (cx, cy)) / (fx, fy)).T
    assert np.abs(x * math.cos(edge.theta) + y * math.sin(edge.theta) - edge.rho).max() < 1e-9
    again = render_frame(sample_scene(Variation(base=TruthScene(depth_noise=0.0)), 5))
    assert np.array_equal(again.frame.rgb, truth.frame.rgb) and np.array_equal(again.frame.depth, truth.frame.depth)


def test_surface_is_measured_with_an_honest_covariance() -> None:
    distances = []
    for seed in range(4):
        truth = render_frame(sample_scene(FAMILIES["near wall"], seed))
        plane = OwnMethod().detect(truth.frame, truth.seed).plane
        assert plane is not None
        error = plane.inverse_depth - truth.plane
        distances.append(float(error @ np.linalg.solve(plane.covariance, error)))
        assert abs(plane.distance_m - 1.0 / np.linalg.norm(truth.plane)) < 0.01
        cosine = float(-plane.normal @ truth.plane / np.linalg.norm(truth.plane))
        assert math.degrees(math.acos(min(1.0, cosine))) < 1.5
    assert np.median(distances) < 12.0  # 3 expected


def sequence(count: int, step: tuple[float, float, float]) -> list:
    """A hand-held motion: the camera shifts and turns from frame to frame."""
    start = sample_scene(FAMILIES["printed"], 3)
    frames = []
    for k in range(count):
        shift = start.translation + k * np.array([0.004, -0.003, 0.002])
        scene = dataclasses.replace(start, rotation=turned(*(k * s for s in step)) @ start.rotation, translation=shift)
        frames.append(render_frame(scene, k, noise_seed=1000 + k))
    return frames


def test_following_keeps_identities_and_stays_right() -> None:
    method, identities = OwnMethod(), {}
    for k, truth in enumerate(sequence(6, (0.006, -0.012, 0.008))):
        result = method.follow(truth.frame, truth.seed)
        assert result.tracked == (k > 0)
        for side, edge in truth.edges.items():
            guide = result.guides[side]
            assert guide is not None, (k, side)
            middle, angle, ends = line_errors(edge, guide.rho, guide.theta, truth.frame.intrinsics)
            assert middle < 0.5 and angle < 1.0 and ends < 2.0
            assert identities.setdefault(side, guide.line_id) == guide.line_id
            found = [line_errors(edge, line.rho, line.theta, truth.frame.intrinsics) for line in result.candidates]
            assert sum(ends < 2.0 for _, _, ends in found) == 1, "an edge is listed once"
    other = render_frame(sample_scene(FAMILIES["small picture"], 3))
    assert method.follow(other.frame, other.seed).refused is None, "another camera's picture is understood alone"
    assert len(set(identities.values())) == len(identities)


ENDS = np.array([[-0.3, 0.0], [0.3, 0.0]])


def top(identity: int, score: float) -> TrackState:
    """A level track with the surface below it."""
    return TrackState(
        track_id=identity,
        line=RefinedLine(
            0.0, 0.5 * math.pi, np.eye(2), ENDS, ("end", "end"), 1.0, 0.1, 300.0, np.zeros(3), 600.0 * ENDS
        ),
        role="horizontal",
        kind="board",
        surface_side=1,
        score=score,
        certainty=0.9,
        borders_plane=True,
        theta=0.5 * math.pi,
    )


def test_a_guide_changes_hands_only_after_two_of_three_pictures() -> None:
    keeper, tops = GuideKeeper(), []
    for scores in [(0.8, 0.3), (0.6, 0.9), (0.8, 0.7), (0.6, 0.9), (0.6, 0.9)]:
        guide = keeper.choose((top(1, scores[0]), top(2, scores[1])))["top"]
        assert guide is not None
        tops.append(guide.track_id)
    assert tops == [1, 1, 1, 2, 2]


# 16: a board a fifth the size of its wall; 20: noise parts board and wall until the plane is exact, seed on paint
@pytest.mark.parametrize("seed", [7, 12, 16, 17, 19, 20])
def test_board_before_a_wall_of_its_depth_ends_where_its_light_does(seed: int) -> None:
    errors = run("thin board", 1, seed)
    assert not errors.wrong and not errors.missed, (errors.wrong, errors.missed)


def test_edge_that_a_joint_of_the_wall_prolongs_ends_with_the_surface() -> None:
    truth = render_frame(sample_scene(FAMILIES["thin board"], 8))
    guide, edge = OwnMethod().detect(truth.frame, truth.seed).guides["bottom"], truth.edges["bottom"]
    assert guide is not None and guide.confidence >= 0.5
    assert abs(np.sort(guide.pixels[:, 0]) - np.sort(edge.pixels[:, 0])).max() < 16.0  # two samples


def test_print_under_the_seed_is_not_taken_for_the_surface() -> None:
    errors = run("printed", 2, 3)
    assert not errors.wrong and not errors.missed
