"""Machine code of vision: it computes what the numpy code beside it says, and that one serves without a compiler."""

from __future__ import annotations

import itertools
import shutil
from collections import Counter

import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.symbolic import compiler
from ibvs_qp.vision import (
    Perception,
    VisionConfig,
    classify,
    edge_points,
    flow_solve,
    follow_plane,
    hypotheses,
    lines,
    plane,
    seeds,
    vote,
)
from ibvs_qp.vision import native as native_module
from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.light_samples import gates_of, on_surface, tinted_and_even
from ibvs_qp.vision.native_colors import even_natively
from ibvs_qp.vision.native_plane import NativePlane, Refit
from ibvs_qp.vision.percept import Percept
from ibvs_qp.vision.surface import connected_samples
from sim.bench.mission import Shot, mission_shots
from sim.world.scene import Scene

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler on this machine")
#: Rounding: single precision where pixels are mixed, double elsewhere.
SINGLE, DOUBLE = 1e-5, 1e-9
#: Difference of two medians of a dozen grey levels, one of which rounds the other way.
STEP = 0.1
_LEAST = 10


@pytest.fixture(scope="module")
def shots() -> list[Shot]:
    return list(itertools.islice(mission_shots((424, 240), 40, 3, VehicleParams()), 40))


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch):
    """Lets a test choose its compiler; what was translated for it is forgotten afterwards."""
    native_module.native.cache_clear()
    monkeypatch.setattr(compiler, "PATIENCE_S", 300.0)  # on a busy machine
    yield monkeypatch
    native_module.native.cache_clear()


def see(shots: list[Shot]) -> list[Percept]:
    """What perception makes of pictures followed, and of each by itself."""
    paint = Scene().paint
    config = VisionConfig(paint_color=paint.color, brush_width_m=paint.brush_width_m)
    tracking, searching = Perception(config, VehicleParams()), Perception(config, VehicleParams())
    seen = []
    for shot in shots:
        seen.append(
            tracking.process(shot.frame, attitude=shot.attitude, rotation=shot.rotation, velocity=shot.velocity)
        )
        searching.reset()
        seen.append(searching.process(shot.frame, attitude=shot.attitude, detect=True))
    assert not any(percept.refused for percept in seen)
    return seen


def close(one, two, tolerance: float) -> bool:
    """Whether two results are equal, numbers to rounding."""
    if isinstance(one, (list, tuple)):
        return len(one) == len(two) and all(close(a, b, tolerance) for a, b in zip(one, two, strict=True))
    if isinstance(one, (np.ndarray, float)):
        return np.shape(one) == np.shape(two) and np.allclose(one, two, rtol=tolerance, atol=tolerance, equal_nan=True)
    return one == two


def same_fits(ours, numpys) -> bool:
    """Whether two batches of fitted lines agree."""
    one, two, alive = ours.fits, numpys.fits, numpys.fits.alive
    same = one.alive == alive and np.array_equal(ours.profiles.u, numpys.profiles.u)
    for k in np.flatnonzero(alive):
        a, b = one.lines[k], two.lines[k]
        same &= np.array_equal(one.support[k], two.support[k]) and np.array_equal(one.visible[k], two.visible[k])
        # A profile that ends at half a pixel may count or not: processors round single precision differently.
        same &= one.runs[k] == two.runs[k]
        same &= max(abs(one.seen[k] - two.seen[k]), abs(one.count[k] - two.count[k])) <= 1
        same &= close([a.level, a.slope, a.center, a.rms], [b.level, b.slope, b.center, b.rms], SINGLE)
        same &= abs(a.level_variance / b.level_variance - 1.0) < 1e-3 and close(one.steps[k], two.steps[k], STEP)
        if ours.sides is not None:  # a side read at half a pixel may be rounded either way
            same &= np.mean(np.all(ours.sides[:, k] == numpys.sides[:, k], axis=-1)) > 0.95
    return bool(same)


@needs_compiler
def test_every_function_computes_what_numpy_does(shots: list[Shot], fresh: pytest.MonkeyPatch) -> None:
    fresh.delenv("CC", raising=False)
    calls = Counter()

    def compare(module, native: str, reference, same) -> None:
        function = getattr(module, native)

        def both(library, *args, **kwargs):
            found = function(library, *args, **kwargs)
            assert same(found, reference(*args, **kwargs)), f"{native} differs from numpy"
            calls[native] += 1
            return found

        fresh.setattr(module, native, both)

    def exact(a, b) -> bool:
        return close(a, b, DOUBLE)

    def told(a, b) -> bool:
        return all(exact([x.board, x.paint, x.steps, x.samples], [y.board, y.paint, y.steps, y.samples])
                   for x, y in zip(a, b, strict=True))  # fmt: skip

    def look(*args, **kwargs):
        return classify.look_with_numpy(*args)

    compare(lines, "fit_natively", lines.fit_with_numpy, same_fits)
    compare(edge_points, "points_natively", edge_points.points_with_numpy, exact)
    compare(vote, "voted_natively", vote.voted_with_numpy, exact)
    compare(classify, "look_natively", look, told)
    compare(hypotheses, "_near_natively", hypotheses.near_with_numpy, np.array_equal)
    compare(hypotheses, "_judge_natively", hypotheses.judge_with_numpy, exact)
    compare(seeds, "values_natively", seeds.values_with_numpy, exact)
    compare(flow_solve, "depths_natively", flow_solve.depths_with_numpy, exact)
    compare(flow_solve, "root_natively", flow_solve.root_with_numpy, lambda a, b: close(a, b, 1e-6))
    compare(flow_solve, "solve_natively", flow_solve.solve_with_numpy, lambda a, b: close(a, b, 1e-6))
    see(shots)
    assert len(calls) == 10 and min(calls.values()) > 20, calls


@needs_compiler
def test_the_surface_is_refitted_as_numpy_does(shots: list[Shot], fresh: pytest.MonkeyPatch) -> None:
    fresh.delenv("CC", raising=False)
    calls = Counter()

    def compare(kind: type, name: str, reference: str) -> None:
        function = getattr(kind, name)

        def both(self, *args):
            found, wanted = function(self, *args), getattr(self, reference)(*args)
            calls[name] += 1
            if isinstance(wanted, str):
                assert found == wanted
                return found
            for field in ("inverse_depth", "covariance", "normal", "distance_m", "inlier_share", "residual_sigma"):
                assert close(getattr(found, field), getattr(wanted, field), DOUBLE), field
            np.testing.assert_array_equal(found.component, wanted.component)
            return found

        fresh.setattr(kind, name, both)

    compare(follow_plane.PlaneFollower, "follow", "follow_with_numpy")
    compare(plane.PlaneFitter, "_refine", "_refine_with_numpy")
    see(shots)
    assert min(calls["follow"], calls["_refine"]) > 20, calls


@needs_compiler
def test_samples_and_their_colours_are_read_as_numpy_does(shots: list[Shot], fresh: pytest.MonkeyPatch) -> None:
    frame, paint = shots[0].frame, (200, 30, 30)
    found = []
    for command in ("cc", "no-such-compiler"):
        fresh.setenv("CC", command)
        native_module.native.cache_clear()
        assert (native_module.native() is None) == (command != "cc")
        grid = CoarseGrid(frame.depth.shape, frame.intrinsics, np.zeros(frame.depth.shape, np.uint8), 80)
        depth = frame.depth.copy()
        depth[::7], depth[::5, ::2], depth[::3, ::3] = 0.0, np.nan, np.inf
        coarse, results = grid.sample(frame.rgb), [grid.inverse_depth(depth, 0.1, 5.0)]
        for board, known in itertools.product((None, (180, 40, 40), (120, 130, 140)), (None, paint)):
            colors = SurfaceColors(board, known, 60.0)
            results += [colors.like_around(grid, coarse, seed, 2) for seed in ((10, 20), (25, 60), (0, 0))]
            results += [colors.label(coarse)] if board is None else [colors.label(coarse), colors.table()]
        found.append(results)
    for ours, numpys in zip(*found, strict=True):
        np.testing.assert_array_equal(ours, numpys)
    assert len({part.tobytes() for part in found[0]}) > 8


@needs_compiler
def test_board_light_and_paint_are_learned_as_numpy_does(shots: list[Shot], fresh: pytest.MonkeyPatch) -> None:
    paint, seen = Scene().paint.color, []
    frame = shots[0].frame
    shape = (frame.rgb.shape[0], frame.rgb.shape[1])
    grid = CoarseGrid(shape, frame.intrinsics, np.zeros(shape, np.uint8), 80)
    surfaces = [percept.plane for percept in see(shots)[::2]]
    for chosen in (None, "none"):
        if chosen is not None:
            fresh.setenv("CC", chosen)
        native_module.native.cache_clear()
        colors, results = SurfaceColors(None, paint, 42.0), []
        for (shot, surface), dimmed in itertools.product(zip(shots[::2], surfaces[::2], strict=True), (1.0, 0.7)):
            assert surface is not None
            coarse = grid.sample((shot.frame.rgb * dimmed).astype(np.uint8))
            near = on_surface(grid, shot.frame.depth, surface.inverse_depth, 0.05)
            component = np.zeros(grid.shape, bool)
            component.reshape(-1)[near] = True
            cells = [(10, 20), (25, 60), (40, 10)]
            results += [near, colors.bare(grid, coarse, cells, 2), colors.like_around(grid, coarse, cells[0], 2)]
            colors.learn(coarse, component)
            samples, places = coarse.reshape(-1, 3)[near], grid.design[near, :2]
            even, library = colors.surely_even(coarse, near), native_module.native()
            assert library is not None or not even  # it takes machine code to be sure early
            if library is not None and colors.board is not None:
                counts = even_natively(library, coarse, near, None, colors.board, gates_of(42.0))
                parts = tinted_and_even(samples.astype(np.float32), colors.board, 42.0)
                assert counts == tuple(int(part.sum()) for part in parts[2:])
            uneven = not even and colors.learn_light(samples, places, shape, frame.intrinsics)
            colors.light = None
            colors.learn_paint(grid, coarse, near)
            results += [colors.board, uneven, colors.paint]
        seen.append(results)
    assert len({part.tobytes() for part in seen[0][5::6]}) > 2  # the paint was seen in several lights
    for one, two in zip(*seen, strict=True):
        np.testing.assert_allclose(one, two, rtol=SINGLE)


@needs_compiler
def test_parts_of_the_surface_connect_as_in_opencv(fresh: pytest.MonkeyPatch) -> None:
    fresh.delenv("CC", raising=False)
    library, rng = native_module.native(), np.random.default_rng(5)
    assert library is not None
    mask = np.zeros((120, 200), np.uint8)
    mask[80:, 60:90] = 255
    grid = CoarseGrid(mask.shape, (150.0, 150.0, 99.5, 59.5), mask, 50)
    config = PlaneConfig(min_samples=_LEAST)
    inverse = np.full(grid.shape, 2.0)
    for share, seed in itertools.product((0.45, 0.6, 0.7), (None, (0, 0), (12, 25), (29, 49))):
        labels = (rng.random(grid.shape) < share).astype(np.uint8)
        chosen = (labels == 1) & grid.free
        wanted = connected_samples(chosen, grid, seed)
        native_plane = NativePlane(library, config, grid, grid.design, _LEAST, 8, (0.0, 0.0))
        refit = native_plane.refit(inverse, labels, np.array([0.0, 0.0, 2.0]), seed=seed)
        if isinstance(refit, Refit):
            np.testing.assert_array_equal(refit.component, wanted)
        else:
            assert np.count_nonzero(wanted) < _LEAST, refit


@needs_compiler
def test_without_a_compiler_the_same_is_seen(shots: list[Shot], fresh: pytest.MonkeyPatch) -> None:
    found = []
    for command in ("cc", "no-such-compiler"):
        fresh.setenv("CC", command)
        native_module.native.cache_clear()
        assert (native_module.native() is None) == (command != "cc")
        found.append(see(shots))
    for ours, numpys in zip(*found, strict=True):
        assert close(ours.features.plane, numpys.features.plane, DOUBLE)
        assert [line.track_id for line in ours.features.lines] == [line.track_id for line in numpys.features.lines]
        for one, two in zip(ours.features.lines, numpys.features.lines, strict=True):
            assert close([one.rho, one.theta, one.segment], [two.rho, two.theta, two.segment], SINGLE)
        assert close(ours.features.velocity, numpys.features.velocity, SINGLE)


def test_a_compiler_that_fails_is_reported_once_and_numpy_serves(
    fresh: pytest.MonkeyPatch, tmp_path, caplog: pytest.LogCaptureFixture
) -> None:
    fresh.setenv("CC", "false")
    fresh.setenv("IBVS_QP_CACHE", str(tmp_path))
    assert native_module.native() is None and native_module.native() is None
    assert len(caplog.records) == 1 and "numpy" in caplog.text
