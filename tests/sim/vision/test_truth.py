"""The flight's perception on truth frames: row 2 follows its guide and never its own fresh edge."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from row_2_scene import attitude_of, row_2_scene

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.vision import LineHint, Perception, VisionConfig
from sim.bench.vision import mission_shots
from sim.world.scene import Scene
from tests.support.truth import render_frame
from tests.support.truth.accuracy import line_errors

#: Pictures of one view: two confirm a track, the third is judged.
PICTURES = 3
INTERVAL_NS = 33_333_333


def see(seed: int):
    """PerceptionResult and truth of the last of some pictures of one row-2 view."""
    scene = row_2_scene(seed)
    eye = Perception(VisionConfig(paint_color=scene.strokes[0][1]), VehicleParams())
    below = -0.08 + 0.072 - 0.04  # upper edge of row 1 below the optical axis [m]
    hint = LineHint(
        name="guide",
        rho=below / 0.5,
        theta=0.5 * math.pi,
        kind="paint",
        surface_side=-1,
        gate_px=14.0,
        span=(0.1, 0.5),
    )
    for k in range(PICTURES):
        truth = render_frame(scene, (k + 1) * INTERVAL_NS, noise_seed=10_000 * seed + k)
        perceived = eye.process(truth.frame, attitude=attitude_of(scene), rotation=np.zeros(3), hints=(hint,))
    return perceived, truth


@pytest.mark.slow
def test_row_2_takes_the_guide_in_every_picture() -> None:
    offsets, angles = [], []
    for seed in range(60):
        perceived, truth = see(seed)
        assert perceived.plane is not None, perceived.refused
        [guide] = [track for track in perceived.tracks if track.hint == "guide"]
        assert guide.confirmed and guide.seen
        fx, _, cx, _ = truth.frame.intrinsics
        edge = truth.strokes["0 top"]
        offset = line_errors(edge, guide.rho, guide.theta, truth.frame.intrinsics)
        fresh = line_errors(truth.strokes["1 top"], guide.rho, guide.theta, truth.frame.intrinsics)
        assert offset[2] < 2.0 and fresh[0] > 40.0, seed
        assert (guide.segment[:, 0] * fx + cx).max() > 500.0, "it lies ahead of the brush"
        # where it is seen, not where row 2 has covered it
        across = guide.segment.mean(axis=0) @ np.array([math.cos(edge.theta), math.sin(edge.theta)])
        offsets.append(abs(across - edge.rho) * fx)
        angles.append(offset[1])
    assert np.median(offsets) <= 0.05 and np.percentile(offsets, 95) <= 0.3, offsets
    assert np.median(angles) <= 0.03, angles


def test_a_cold_start_in_row_2_tells_board_from_paint() -> None:
    """Most places beside the brush are painted then: the surface is sought where it is bare."""
    vehicle, paint = VehicleParams(), Scene().paint
    shot = next(itertools.islice(mission_shots((640, 480), 16, 1, vehicle), 12, None))
    config = VisionConfig(paint_color=paint.color, brush_width_m=paint.brush_width_m)
    perceived = Perception(config, vehicle).process(shot.frame, attitude=shot.attitude, detect=True)
    sure = [(entry.kind, entry.role) for entry in perceived.candidates if entry.confidence >= 0.8]
    assert perceived.plane is not None and perceived.plane.inlier_share > 0.5
    assert sure.count(("board", "horizontal")) == 1, "the lower border"
    assert sure.count(("paint", "horizontal")) >= 2, "row 1's lower edge, its upper edge ahead, row 2's fresh one"
