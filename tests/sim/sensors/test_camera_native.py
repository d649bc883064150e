"""Machine code that draws pictures: what OpenCV and numpy draw, the same bits from wide registers and without them."""

import ctypes
import shutil
from pathlib import Path

import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.model.shared_library import shared_library, wide_registers
from sim.sensors.cameras import PlaneCamera, drawn, plane
from sim.world.canvas import Canvas
from sim.world.scene import BoardScene, CameraScene, Scene

SCENE = Scene(camera=CameraScene(width=424, height=240), board=BoardScene(slope_deg=2.0))
#: Place before the board (along, up), distance [m] and turn [rad]: inside, at edges and corners, beside, far, tilted.
PLACES = (
    (0.7, 0.3, 0.7, 0.0),
    (0.7, 0.05, 0.7, 0.003),
    (1.35, 0.05, 0.7, 0.01),
    (0.05, 0.12, 0.7, 0.02),
    (0.7, 0.55, 1.5, 0.1),
    (-0.3, 0.3, 1.0, 0.2),
    (2.0, 0.3, 1.0, 0.0),
    (0.7, 0.3, 0.32, 0.0),
)
needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler on this machine")


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch):
    """Translates with the system's compiler, whatever the environment asks for."""
    monkeypatch.delenv("CC", raising=False)
    drawn.native.cache_clear()
    yield
    drawn.native.cache_clear()


def pictures(noise: bool = True, places=PLACES) -> tuple[list[RgbdFrame], PlaneCamera]:
    """Pictures of a board that is painted between them, and the camera that took them."""
    canvas = Canvas(SCENE, 3)
    camera, rng, frames = PlaneCamera(SCENE, VehicleParams(), canvas, 5, noise=noise), np.random.default_rng(0), []
    for k, (along, up, distance, turn) in enumerate(places):
        y, z = canvas.geometry.point(along, up)
        attitude = np.array([1.0, *(turn * rng.standard_normal(3))])
        canvas.stroke((0.7, 0.05), (0.7 - 0.04 * k, 0.05))
        frames.append(camera.capture(np.array([-distance, y, z]), attitude / np.linalg.norm(attitude), k))
    return frames, camera


@needs_compiler
@pytest.mark.parametrize("noise", [False, True])
def test_machine_code_draws_what_opencv_does(noise: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    ours, camera = pictures(noise)
    assert camera._drawing is not None
    monkeypatch.setattr(plane, "native", lambda: None)
    theirs, other = pictures(noise)
    assert other._drawing is None
    for one, two in zip(ours, theirs, strict=True):
        difference = np.abs(one.rgb.astype(int) - two.rgb)
        assert difference.max() <= 1 and np.mean(difference) < 0.01  # sums in 256ths against single precision
        assert np.array_equal(one.depth == 0.0, two.depth == 0.0)
        known = one.depth > 0.0
        ratio = one.depth[known] / two.depth[known]
        beyond = np.abs(ratio - 1.0) > 1e-6
        # without noise the rim has a depth: a pixel that the outline touches is board here and wall there
        assert np.count_nonzero(beyond) <= (0 if noise else sum(one.depth.shape))
    assert camera.finish.rng.random() == other.finish.rng.random()  # both have drawn the same numbers


@needs_compiler
def test_where_the_texture_ends_a_plain_wall_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    far = [
        (2.5, 0.3, 1.0, 0.0),
        (-1.0, 0.3, 1.5, 0.0),
        (0.7, 0.3, 5.0, 0.1),
        (0.7, -0.8, 1.0, 0.3),
        (0.7, 0.3, 1.0, 2.0),
    ]
    ours, _ = pictures(False, far)
    monkeypatch.setattr(plane, "native", lambda: None)
    theirs, _ = pictures(False, far)
    for one, two in zip(ours, theirs, strict=True):
        assert np.mean(np.abs(one.rgb.astype(int) - two.rgb).max(axis=2) > 1) < 0.02  # the seam is a pixel wide


@needs_compiler
@pytest.mark.skipif(not wide_registers(), reason="this processor has no wide registers")
def test_wide_registers_give_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    wide, _ = pictures()
    folder = Path(drawn.__file__).with_name("native")
    code = "".join((folder / name).read_text() for name in drawn.FILES)
    library = ctypes.CDLL(str(shared_library("drawing", code, ["cc"], drawn.FLAGS)))
    monkeypatch.setattr(plane, "native", lambda: library)
    narrow, camera = pictures()
    assert camera._drawing is not None
    for one, two in zip(wide, narrow, strict=True):
        assert np.array_equal(one.rgb, two.rgb) and np.array_equal(one.depth, two.depth)
