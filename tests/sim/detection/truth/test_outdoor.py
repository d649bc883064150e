"""Pictures outside: effects by seed, none when switched off, the rule of shadows, and guides in every family."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.vision.appearance.light import shaded_colors
from sim.detection.own import OwnMethod
from sim.sensors.cameras import PlaneCamera
from sim.sensors.cameras.curved import CurvedCamera
from sim.world.canvas import Canvas
from sim.world.errors import OutdoorErrors, WorldErrors, world_errors, world_names
from sim.world.random_streams import stream
from sim.world.scene import Scene, SurfaceScene
from tests.support.truth import FAMILIES, TruthScene, render_frame, sample_scene
from tests.support.truth.accuracy import line_errors
from tests.support.truth.outdoor import OUTSIDE, frames, measure

VEHICLE = VehicleParams()


def flown(outdoor: OutdoorErrors, right_m: float = 0.0, seed: int = 3, kind: str = "plane", noise: bool = False):
    """A picture of a flight, half a metre before a board with a wet stroke."""
    scene = Scene(surface=SurfaceScene(kind=kind), errors=WorldErrors(outdoor=outdoor))
    canvas = Canvas(scene, 1)
    for k in range(50):
        canvas.stroke(None if k == 0 else (0.5 + 0.01 * (k - 1), 0.3), (0.5 + 0.01 * k, 0.3))
    camera = (PlaneCamera if kind == "plane" else CurvedCamera)(scene, VEHICLE, canvas, seed, noise=noise)
    tip = canvas.geometry.start_tip + np.array((0.3, right_m - 0.5, -0.25))
    return camera.capture(tip - np.array(VEHICLE.tip_position_m), np.array([1.0, 0.0, 0.0, 0.0]), 0)


@pytest.mark.parametrize("family", OUTSIDE)
def test_an_effect_changes_the_picture_and_repeats_by_its_seed(family: str) -> None:
    plain, seen = flown(OutdoorErrors()).rgb.astype(int), flown(OUTSIDE[family])
    assert np.array_equal(flown(OUTSIDE[family]).rgb, seen.rgb)
    assert (np.abs(seen.rgb - plain).max(axis=2) > 20).mean() > 0.002
    assert not np.array_equal(flown(OUTSIDE[family], seed=4).rgb, seen.rgb)
    bent = flown(OUTSIDE[family], kind="cylinder").rgb - flown(OutdoorErrors(), kind="cylinder").rgb.astype(int)
    assert (np.abs(bent).max(axis=2) > 20).mean() > 0.002


def test_without_effects_pictures_are_as_before() -> None:
    scene = sample_scene(FAMILIES["near wall"], 5)
    seen = render_frame(dataclasses.replace(scene, outdoor=OutdoorErrors(beam_shade=0.5)))  # a beam's, and no beam
    assert np.array_equal(render_frame(scene).frame.rgb, seen.frame.rgb)
    assert np.array_equal(render_frame(scene).frame.depth, seen.frame.depth)
    assert [world for world in world_names() if world_errors(world).outdoor != OutdoorErrors()] == ["field"]


def test_a_flight_has_some_of_the_effects_by_its_seed() -> None:
    field = world_errors("field").outdoor
    drawn = [field.drawn(stream(seed, "outdoor effects")) for seed in range(200)]
    for name in ("beams", "own_shade", "glare", "rust_per_m", "wet_gloss", "drops"):
        present = [bool(getattr(each, name)) for each in drawn]
        assert 0.2 < np.mean(present) < 0.4, name
    assert all(bool(each.wet_gloss) == bool(each.wet_holes) for each in drawn)
    assert field.drawn(stream(3, "outdoor effects")) == drawn[3]
    assert dataclasses.replace(field, chance=0.0).drawn(stream(3, "outdoor effects")) == OutdoorErrors()
    assert dataclasses.replace(field, chance=1.0).drawn(stream(3, "outdoor effects")) == dataclasses.replace(
        field, chance=1.0
    )


def test_wall_and_lens_keep_their_effects_and_the_own_shadow_moves() -> None:
    """A step of 40 mm to the right moves what is fixed on the wall by 40 mm, and nothing on the lens."""

    def change(family: str, right_m: float) -> np.ndarray:
        bare = flown(OutdoorErrors(), right_m).rgb.astype(np.float32) + 1.0
        return ((flown(OUTSIDE[family], right_m).rgb + 1.0) / bare).mean(axis=2)

    focal = flown(OutdoorErrors()).intrinsics[0]
    step = 0.04
    for family, moves in (("stains", True), ("own shadow", False), ("drops and dust", False)):
        before, behind = change(family, 0.0), change(family, step)
        # depth of the face: the tip's distance and the camera's way to it
        pixels = round(focal * step / (0.15 + VEHICLE.tip_position_m[0] - VEHICLE.camera_position_m[0]))
        shifted = np.roll(before, -pixels if moves else 0, axis=1)
        unlike = np.abs(behind - shifted)[:, 60:-60].mean()
        wrong = np.abs(behind - (before if moves else np.roll(before, -pixels, axis=1)))[:, 60:-60].mean()
        assert unlike < 0.5 * wrong, (family, unlike, wrong)


def test_wet_paint_loses_depth_and_dry_board_does_not() -> None:
    for kind in ("plane", "cylinder"):  # a camera without noise has no holes at all
        dry, wet = (flown(OutdoorErrors(wet_gloss=0.4, wet_holes=part), kind=kind, noise=True) for part in (0.0, 0.7))
        assert (wet.depth == 0.0).mean() > (dry.depth == 0.0).mean() + 0.002
    truth = dict(frames(["wet paint", "rust"], 0))
    lost = {family: float((frame.frame.depth == 0.0).mean()) for family, frame in truth.items()}
    assert lost["wet paint"] > lost["rust"] + 0.005


@pytest.mark.parametrize(("light", "tint", "shade"), [(0.4, 0.0, True), (0.6, 0.04, True), (0.97, 0.0, False)])
def test_a_shadow_scales_all_channels_alike(light: float, tint: float, shade: bool) -> None:
    board = np.array([228.0, 226.0, 220.0])
    dark = board * light * (1.0, 1.0 + tint, 1.0 + 2.0 * tint)
    assert bool(shaded_colors(dark, board)) == shade and bool(shaded_colors(board, dark)) == shade


@pytest.mark.parametrize(("light", "white"), [(1.0, 60.0), (0.7, 150.0), (1.0, 100.0)])  # green is cut off in the last
def test_glare_adds_white_light_to_a_colour(light: float, white: float) -> None:
    lime = np.array([126.0, 195.0, 39.0])
    assert shaded_colors(np.minimum(light * lime + white, 255.0), lime)


def test_another_colour_is_no_glare() -> None:
    lime = np.array([126.0, 195.0, 39.0])
    others = np.array(
        [[80, 130, 200], [210, 230, 255], [190, 50, 50], [150, 112, 92], [211, 145, 155], [205, 200, 190]]
    )
    assert not shaded_colors(others, lime).any()
    assert not shaded_colors(np.array([[255, 255, 255], [255, 255, 20]]), lime).any()  # cut off: nothing is known


@pytest.mark.parametrize("gain", [1.0, 1.1, 1.2, 1.3])  # channels are cut off one after the other
def test_paint_and_brick_are_no_shadow(gain: float) -> None:
    board = np.minimum(gain * np.array([228.0, 226.0, 220.0]), 255.0)
    others = gain * np.array([[40, 90, 200], [150, 112, 92], [180, 120, 100], [190, 50, 50], [12, 12, 12]])
    assert not shaded_colors(np.minimum(others, 255.0), board).any()


# sand, and walls that are duller, greener or paler by more than glare
def test_other_tints_are_no_glare() -> None:
    sand = np.array([200.0, 175.0, 130.0])
    assert not shaded_colors(np.array([[200, 215, 175], [190, 182, 168], [215, 220, 185]]), sand).any()


def guide_errors(scene: TruthScene) -> list[float]:
    """Largest distance of every guide from its edge [px]; infinite for none."""
    truth = render_frame(scene)
    guides = OwnMethod().detect(truth.frame, truth.seed).guides
    found = []
    for side, edge in truth.edges.items():
        line = guides[side]
        errors = (math.inf,) if line is None else line_errors(edge, line.rho, line.theta, truth.frame.intrinsics)
        found.append(max(errors))
    return found


def test_a_grey_wall_close_behind_a_white_board_is_no_shadow() -> None:
    """It has the tint of a shadow, but a step of depth."""
    scene = sample_scene(FAMILIES["near wall"], 2)
    scene = dataclasses.replace(scene, board_color=(228, 228, 228), wall_color=(130, 130, 130), wall="plain")
    for gap_m in (0.05, 0.02):
        assert max(guide_errors(dataclasses.replace(scene, gap_m=gap_m))) < 2.0, gap_m


def test_brick_close_behind_an_overexposed_board_is_no_shadow() -> None:
    scene = dataclasses.replace(sample_scene(FAMILIES["near wall"], 2), gap_m=0.005, shading=0.0)
    seen = dataclasses.replace(scene, board_color=(255, 244, 224), wall_color=(196, 146, 120))  # red is cut off
    assert max(guide_errors(seen)) < 2.0


# 46: the board's middle is in shadow; 7: two shadows across, the nearer one along the side
@pytest.mark.parametrize("seed", [7, 46])
def test_a_shadow_across_the_board_hides_none_of_its_edges(seed: int) -> None:
    figures = measure(["beam shadow"], [seed])["beam shadow"]
    assert figures.errors.found == 1.0 and not figures.errors.wrong, figures.errors.missed


@pytest.mark.parametrize("seed", [4, 9])
def test_a_line_is_followed_across_a_shadow(seed: int) -> None:
    ((_, truth),), method = frames(["beam shadow"], seed), OwnMethod()
    seen = [
        method.follow(dataclasses.replace(truth.frame, stamp_ns=k * 33_000_000), truth.seed).guides["right"]
        for k in range(4)
    ]
    first, *later = [0.0 if line is None else float(np.hypot(*(line.pixels[1] - line.pixels[0]))) for line in seen]
    assert min(later) > 0.95 * first > 100.0


# paint runs along the edge 9 px inside it, where depth ends soon as well; in 207 a longer line leans off the edge
def test_a_run_of_paint_beside_the_edge_is_not_taken_for_it() -> None:
    figures = measure(["stains"], [15, 18, 207])["stains"]
    assert not figures.sure_wrong and figures.errors.found == 1.0


@pytest.mark.slow
def test_guides_outside_are_found_and_no_other_one_is_sure_and_wrong() -> None:
    for family, figures in measure(OUTSIDE, range(200, 220)).items():
        assert figures.errors.found >= 0.95, (family, figures.errors.missed)
        assert not figures.sure_wrong, (family, figures.sure_wrong)
