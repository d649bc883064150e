"""What a fitted line says of itself, whichever way its normal points and wherever it ends."""

from __future__ import annotations

import itertools
import math

import cv2
import numpy as np
import pytest

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig, VisionConfig
from ibvs_qp.vision.lines.refine import LineFits, RefinedLine
from ibvs_qp.vision.picture.layout import PictureLayout
from ibvs_qp.vision.picture.picture import Picture

SIZE, INTRINSICS = (480, 640), (600.0, 480.0, 319.5, 239.5)
DARK, BRIGHT, EDGE = 60, 200, 140
FITS = LineFits(LineConfig(), SurfaceColors(None, None, LineConfig().color_gate))


def picture(*, upright: bool, first: int = 0, last: int = 10_000) -> Picture:
    """Bright beyond an edge at row or column 140 that leans by 0.01, from one column or row to another."""
    v, u = np.indices(SIZE)
    along, across = (v, u) if upright else (u, v)
    bright = (across + 0.01 * along > EDGE) & (along >= first) & (along < last)
    rgb = np.where(bright, BRIGHT, DARK)[..., None] + np.random.default_rng(4).normal(0.0, 1.0, (*SIZE, 3))
    rgb = cv2.GaussianBlur(np.clip(rgb, 0, 255).astype(np.uint8), (0, 0), 0.7)
    frame = RgbdFrame(rgb=rgb, depth=np.zeros(SIZE, np.float32), intrinsics=INTRINSICS, stamp_ns=0)
    return Picture(frame, PictureLayout(frame, VisionConfig(), None))


def fitted(
    seen: Picture, *, upright: bool, turned: bool = False, span: tuple[float, float] | None = None
) -> RefinedLine:
    focal, center = INTRINSICS[0 if upright else 1], INTRINSICS[2 if upright else 3]
    rho, theta = (EDGE - center) / focal, 0.0 if upright else 0.5 * math.pi
    if turned:
        rho, theta = -rho, theta - math.pi
    [line] = FITS.fit_lines(seen, [FITS.query(rho, theta, span=span)], 14.0, contents=True)
    assert line is not None
    return line


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("upright", [False, True])
def test_step_and_sides_follow_the_normal_and_the_places_lie_on_the_line(upright: bool, turned: bool) -> None:
    line = fitted(picture(upright=upright), upright=upright, turned=turned)
    before, behind = (BRIGHT, DARK) if turned else (DARK, BRIGHT)
    assert line.sides.shape[1] == len(line.pixels) > 30
    np.testing.assert_allclose(line.sides.mean(axis=(1, 2)), (before, behind), atol=2.0)
    np.testing.assert_allclose(line.step, behind - before, atol=3.0)
    points = (line.pixels - INTRINSICS[2:]) / INTRINSICS[:2]
    np.testing.assert_allclose(points @ (math.cos(line.theta), math.sin(line.theta)), line.rho, atol=1e-9)
    along = line.pixels[:, 1 if upright else 0]
    np.testing.assert_allclose(line.pixels[:, 0 if upright else 1] + 0.01 * along, EDGE, atol=0.3)


@pytest.mark.parametrize("upright", [False, True])
def test_a_turned_normal_is_the_same_line(upright: bool) -> None:
    line, turned = (fitted(picture(upright=upright), upright=upright, turned=each) for each in (False, True))
    assert (turned.rho, turned.theta) == pytest.approx((-line.rho, line.theta - math.pi), abs=1e-12)
    np.testing.assert_allclose(turned.covariance, line.covariance * [[1.0, -1.0], [-1.0, 1.0]], rtol=1e-9)
    np.testing.assert_allclose(turned.segment, line.segment, atol=1e-12)


@pytest.mark.parametrize("upright", [False, True])
def test_a_line_is_most_certain_at_the_middle_of_its_segment(upright: bool) -> None:
    """Level and slope are independent there: the variance of the distance, over places along the line, is least."""
    line = fitted(picture(upright=upright, last=200), upright=upright)  # to one side of the camera's axis
    middle = line.segment.mean(axis=0) @ (-math.sin(line.theta), math.cos(line.theta))
    assert abs(middle) > 0.2
    places = np.linspace(-0.5, 0.5, 41)
    variances = [float((1.0, -along) @ line.covariance @ (1.0, -along)) for along in places]
    assert places[int(np.argmin(variances))] == pytest.approx(float(middle), abs=0.03)


@pytest.mark.parametrize("upright", [False, True])
def test_ends_are_named_by_their_reason(upright: bool) -> None:
    assert fitted(picture(upright=upright), upright=upright).ends == ("picture", "picture")
    assert fitted(picture(upright=upright, first=150, last=350), upright=upright).ends == ("end", "end")
    assert fitted(picture(upright=upright), upright=upright, span=(-0.2, 0.2)).ends == ("span", "span")
    hidden = picture(upright=upright)
    hidden.mask[(slice(300, None), slice(None)) if upright else (slice(None), slice(300, None))] = 255
    line = fitted(hidden, upright=upright)
    assert line.ends == ("picture", "mask")
    assert line.pixels[:, 1 if upright else 0].max() < 300


def test_predictions_that_are_no_numbers_find_nothing_and_leave_the_others_alone() -> None:
    bad = (math.nan, math.inf, -math.inf, 1e300)
    queries = [FITS.query(rho, theta) for rho, theta in itertools.product((0.1, *bad), (0.0, *bad))][1:]
    queries += [FITS.query(0.0, 0.0, span=span) for span in itertools.product((0.0, *bad), (0.0, *bad))]
    focal, center = INTRINSICS[1], INTRINSICS[3]
    queries.append(FITS.query((EDGE - center) / focal, 0.5 * math.pi))
    found = FITS.fit_lines(picture(upright=False), queries, 14.0, contents=True)
    assert [line is not None for line in found] == [False] * (len(queries) - 1) + [True]


@pytest.mark.parametrize("behind", [0.02, 0.04, 0.07])
def test_a_joint_of_a_grey_wall_is_no_border_of_a_white_board_in_shadow(behind: float) -> None:
    board, wall, joint = (228, 226, 220), (150, 149, 146), (70, 70, 68)
    rgb = np.empty((*SIZE, 3), np.uint8)
    rgb[:], rgb[:, :320], rgb[:, 328:334] = wall, board, joint
    rgb = cv2.GaussianBlur(rgb, (0, 0), 0.8)
    depth = np.full(SIZE, 1.0 + behind, np.float32)
    depth[:, :320] = 1.0
    colors = SurfaceColors(board, None, LineConfig().color_gate)
    colors.shadowed = True
    fits, frame = LineFits(LineConfig(), colors), RgbdFrame(rgb=rgb, depth=depth, intrinsics=INTRINSICS, stamp_ns=0)
    picture = Picture(frame, PictureLayout(frame, VisionConfig(), None))
    picture.plane = (0.0, 0.0, 1.0)
    focal, middle = INTRINSICS[0], INTRINSICS[2]
    query = fits.query(
        (325.0 - middle) / focal,
        0.0,
        step=np.subtract(wall, board).astype(float),
        span=(-1.0, 1.0),
        extent=(-0.3, 0.3),
        kind="board",
        surface_side=-1,
    )
    [line] = fits.fit_lines(picture, [query], 12.0)
    assert line is not None and abs(line.rho * focal + middle - 319.5) < 0.5
