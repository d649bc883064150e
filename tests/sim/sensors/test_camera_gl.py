"""The OpenGL camera against the plane camera where there is OpenGL, and what happens where there is none."""

from __future__ import annotations

import dataclasses
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from camera_scenes import PLAIN, VEHICLE, facing, flat_canvas, sloped, step_positions
from made_up_flights import fake_fly

import sim.flight.side_by_side
from sim.commands import cli
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.sensors.cameras import CameraUnavailable, PlaneCamera, open_camera, resolve_camera
from sim.sensors.cameras import gl_context as contexts
from sim.sensors.cameras.arm import vehicle_layer
from sim.sensors.cameras.view import View
from sim.world.canvas import Canvas
from sim.world.scene import PaintScene, Scene

BACK_END, WHY_NOT = resolve_camera("gl")
needs_gl = pytest.mark.skipif(BACK_END != "gl", reason=WHY_NOT or "")
#: Required agreement: grey levels, pixels, metres.
GREY, EDGE_PX, DEPTH_M = 3, 0.1, 1e-4
POSES = [(1.2, 0.1, 0.05, 1.0, 0.5, 3.0), (0.2, 0.3, 0.0, -1.0, 0.0, -2.0), (0.7, 0.05, 0.45, 0.5, 0.0, 5.0)]


def gl_camera(scene: Scene, canvas: Canvas, seed: int = 0, **options: bool):
    from sim.sensors.cameras.gl import GLCamera

    return GLCamera(scene, VEHICLE, canvas, seed, **options)


def painted(scene: Scene, canvas: Canvas) -> Canvas:
    previous = None
    for along in np.linspace(0.1, 1.3, 300):
        point = (float(along), 0.09 + 0.02 * float(along))
        canvas.stroke(previous, point)
        previous = point
    return canvas


def away_from(mask: np.ndarray, reach: int) -> np.ndarray:
    import cv2

    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) == 0


def rim_of(camera: PlaneCamera, pose) -> np.ndarray:
    """Pixels that the board's outline runs through, bool (H, W)."""
    import cv2

    scene = camera.scene
    view = View.of_vehicle(*pose, VEHICLE.camera_position_m, camera.intrinsics)
    yz = camera.canvas.geometry.point(
        np.array([0, 1, 1, 0]) * scene.board.width_m, np.array([0, 0, 1, 1]) * scene.board.height_m
    )
    corners = view.pixels(np.column_stack((np.zeros(4), yz)))
    picture = np.zeros((scene.camera.height, scene.camera.width), np.uint8)
    cv2.polylines(picture, [np.rint(corners * 16).astype(np.int32)], True, 255, 1, cv2.LINE_8, 4)
    return picture > 0


@pytest.mark.slow
@needs_gl
@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("clutter", [0, 6])
def test_pictures_agree(pose: tuple[float, ...], clutter: int) -> None:
    """Colours and depth of the two back ends, paint, grain, clutter and vehicle included."""
    scene = dataclasses.replace(Scene(), board=dataclasses.replace(Scene().board, clutter=clutter, slope_deg=1.0))
    where = facing(scene, *pose)
    plane = PlaneCamera(scene, VEHICLE, painted(scene, Canvas(scene, 3)), 0, noise=False)
    gl = gl_camera(scene, painted(scene, Canvas(scene, 3)), noise=False)
    one, two = plane.capture(*where, 7), gl.capture(*where, 7)
    difference = np.abs(one.rgb.astype(int) - two.rgb.astype(int)).max(axis=2)
    rim = rim_of(plane, where)
    clear = away_from(rim, 3)
    assert clear.mean() > 0.9
    assert difference[clear].max() <= GREY
    assert (difference[~clear] > GREY).mean() < 0.02, "mended rims differ in the grain alone"
    assert difference.max() <= 3 * GREY
    off = away_from(rim, 2)  # a pixel on the rim may belong to either side
    assert np.abs(one.depth - two.depth)[off].max() <= DEPTH_M
    assert (two.stamp_ns, two.intrinsics) == (7, one.intrinsics)
    assert two.rgb.dtype == np.uint8 and two.depth.dtype == np.float32


@needs_gl
@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (3.0, -1.0, 0.0), (-2.0, 1.5, 8.0)])
def test_edges_agree(angles: tuple[float, float, float]) -> None:
    """The bottom edge, and a painted one, lie in the same place to a tenth of a pixel, column by column."""
    columns = np.r_[5:180, 460:635]  # clear of arm and brush
    where = facing(PLAIN, 0.7, 0.05, 0.05, *angles)
    edges = []
    for make in (PlaneCamera, None):
        canvas = flat_canvas(PLAIN)
        camera = make(PLAIN, VEHICLE, canvas, 0, noise=False) if make else gl_camera(PLAIN, canvas, noise=False)
        edges.append(step_positions(camera.capture(*where, 0).rgb[..., 0].astype(float)[:, columns], 40.0, 150.0))
    apart = edges[1] - edges[0]
    assert abs(apart.mean()) <= 0.02 and np.abs(apart).max() <= EDGE_PX


@needs_gl
def test_opengl_itself_puts_the_rim_where_the_plane_camera_does() -> None:
    """Without mending: the jagged rim of a sloped edge lies right on the average, so its geometry is OpenGL's own."""
    scene = sloped(PLAIN, 3.0)
    where = facing(scene, 0.7, 0.05, 0.05)
    columns = np.r_[5:180, 460:635]
    rows = []
    for smooth in (True, False):
        camera = gl_camera(scene, flat_canvas(scene), noise=False, smooth_rim=smooth)
        rows.append(step_positions(camera.capture(*where, 0).rgb[..., 0].astype(float)[:, columns], 40.0, 150.0))
    apart = rows[1] - rows[0]
    assert abs(apart.mean()) <= EDGE_PX / 2
    assert 0.2 < np.abs(apart).max() <= 0.6, "jagged"


@needs_gl
def test_row_zero_of_the_texture_is_the_top_and_column_zero_the_left() -> None:
    scene = PLAIN
    canvas = flat_canvas(scene)
    height, width = canvas.rgb.shape[:2]
    canvas.flush()[8 : 8 + height // 2, 8 : 8 + width // 2, :3] = (200, 0, 0)
    frame = gl_camera(scene, canvas, noise=False).capture(*facing(scene, 0.7, 0.30, 0.3), 0)
    u, v = 319, 239 - round(0.08 / (0.5 + 0.3) * 625.2)  # the board's middle, 0.08 m above the camera's axis
    quarter = 90
    patches = [frame.rgb[v + dv, u + du, 0] for dv in (-quarter, quarter) for du in (-quarter, quarter)]
    assert (np.array(patches) > 100).tolist() == [True, False, False, False]


@needs_gl
def test_fresh_paint_is_uploaded_where_it_is() -> None:
    """Only the box of a stroke goes to the driver; strokes over the outline and between captures count as well."""
    scene = dataclasses.replace(Scene(), board=dataclasses.replace(Scene().board, clutter=0))
    canvas, other = Canvas(scene, 1), Canvas(scene, 1)
    gl = gl_camera(scene, canvas, noise=False)
    where = facing(scene, 0.4, 0.10, 0.1)
    gl.capture(*where, 0)
    for start, stop in (((0.30, 0.10), (0.45, 0.12)), ((0.45, 0.12), (0.45, -0.05)), ((0.5, 0.2), (0.6, 0.2))):
        canvas.stroke(start, stop)
        other.stroke(start, stop)
    late = gl.capture(*where, 1).rgb
    fresh = gl_camera(scene, other, noise=False).capture(*where, 1).rgb
    assert np.array_equal(late, fresh)


@needs_gl
def test_noise_holes_and_arm_are_those_of_the_plane_camera() -> None:
    scene = Scene()
    where = facing(scene, 1.2, 0.1, 0.2, 1.0, 0.5, 3.0)
    plane = PlaneCamera(scene, VEHICLE, Canvas(scene, 3), 9)
    gl = gl_camera(scene, Canvas(scene, 3), 9)
    arm = vehicle_layer(scene, VEHICLE, gl.intrinsics, np.random.default_rng(0)).mask > 0
    inside = away_from(~arm, 2)
    for stamp in range(3):
        one, two = plane.capture(*where, stamp), gl.capture(*where, stamp)
        assert np.array_equal(one.depth == 0.0, two.depth == 0.0)
        assert np.array_equal(one.rgb[inside], two.rgb[inside]) and np.array_equal(one.depth[inside], two.depth[inside])
        clear = away_from(rim_of(plane, where), 3)
        assert np.abs(one.rgb.astype(int) - two.rgb.astype(int))[clear].max() <= GREY
        assert np.abs(one.depth - two.depth)[clear].max() <= DEPTH_M


@needs_gl
def test_same_seed_same_bits_with_other_contexts_between() -> None:
    scene = Scene()
    poses = [facing(scene, along, 0.05, 0.1) for along in (0.3, 0.7, 1.1)]
    first = gl_camera(scene, Canvas(scene, 2), 5)
    one = [first.capture(*pose, 0) for pose in poses]
    second, third = gl_camera(scene, Canvas(scene, 2), 5), gl_camera(PLAIN, flat_canvas(PLAIN), 1)
    for pose, frame in zip(poses, one, strict=True):
        again = second.capture(*pose, 0)
        third.capture(*pose, 0)
        assert np.array_equal(again.rgb, frame.rgb) and np.array_equal(again.depth, frame.depth)
    third.close()
    third.close()


@needs_gl
@pytest.mark.slow
def test_a_short_job_is_painted_by_opengl_as_well_as_by_the_plane_camera() -> None:
    job = dataclasses.replace(PaintScene(), stroke_m=0.3, rows=1)
    board = dataclasses.replace(Scene().board, width_m=0.4)
    scene = dataclasses.replace(Scene(), paint=job, board=board)
    size = (424, 240)
    traces = {
        camera: fly(scene, FlightOptions(camera=camera, image_size=size, video=False)) for camera in ("plane", "gl")
    }
    # Not tick by tick: how long alignment takes hangs on the last millimetre per second of a hover.
    for camera, trace in traces.items():
        figures = compute_metrics(trace)
        assert figures["completed"], (camera, figures["reason"])
        assert figures["path_rms_straight_m"] <= 0.005 and figures["coverage"] >= 0.97, (camera, figures)
        assert figures["tilt_rms_deg"] <= 1.0 and figures["contact_share"] >= 0.99, (camera, figures)


@pytest.fixture
def bare(monkeypatch) -> None:
    """A machine on which neither library is found; what is loaded in this process stays as it is."""

    def missing(platform: str) -> None:
        raise AttributeError("'NoneType' object has no attribute 'eglQueryString'")

    monkeypatch.setattr(contexts, "_load", missing)
    monkeypatch.setattr(contexts, "_forget", lambda platform: None)


def test_without_opengl_the_plane_camera_flies_and_one_line_says_so(bare) -> None:
    for option in ("gl", "auto"):
        camera, note = resolve_camera(option)
        assert camera == "plane" and note is not None
        for word in (f"--camera {option}", "egl: library not found", "osmesa: library", "libegl1", "flying with plane"):
            assert word in note
        assert "\n" not in note
    assert resolve_camera("plane") == ("plane", None)
    canvas = Canvas(PLAIN, 0)
    assert isinstance(open_camera("auto", PLAIN, VEHICLE, canvas, 0), PlaneCamera)
    with pytest.raises(CameraUnavailable, match="libegl1"):
        open_camera("gl", PLAIN, VEHICLE, canvas, 0)


def test_osmesa_is_tried_after_egl(monkeypatch) -> None:
    tried = []

    class Context:
        def free(self) -> None:
            tried.append("freed")

    class Module:
        def __init__(self, platform: str) -> None:
            self.platform = platform

        def GLContext(self, width: int, height: int) -> Context:
            tried.append(self.platform)
            if self.platform == "egl":
                raise ImportError("Cannot initialize a EGL device display. This likely means ...")
            return Context()

    monkeypatch.setattr(contexts, "_load", Module)
    monkeypatch.setattr(contexts, "_prove", lambda context: None)
    monkeypatch.setattr(contexts, "_forget", lambda platform: tried.append(f"forget {platform}"))
    monkeypatch.delenv("PYOPENGL_PLATFORM", raising=False)
    monkeypatch.delitem(sys.modules, "OpenGL", raising=False)
    _, platform = contexts.open_context(64, 64)
    assert platform == "osmesa" and tried == ["egl", "forget egl", "osmesa"]


@needs_gl
def test_a_picture_larger_than_the_driver_takes_is_refused() -> None:
    scene = dataclasses.replace(Scene(), board=dataclasses.replace(Scene().board, width_m=20.0, height_m=0.2))
    with pytest.raises(CameraUnavailable, match="exceeds OpenGL's largest"):
        gl_camera(scene, Canvas(scene, 0))


def test_nothing_of_opengl_is_loaded_before_it_is_asked_for() -> None:
    code = (
        "import sys, os; import sim.sensors.cameras, sim.flight.closed_loop;"
        "print(sorted(n for n in sys.modules if n.startswith(('OpenGL', 'mujoco.egl', 'mujoco.osmesa', 'glfw'))));"
        "print([n for n in ('MUJOCO_GL', 'PYOPENGL_PLATFORM') if n in os.environ])"
    )
    clean = {name: value for name, value in os.environ.items() if name not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, env=clean)
    assert done.returncode == 0, done.stderr
    loaded, variables = done.stdout.splitlines()
    assert variables == "[]"
    assert "OpenGL" not in loaded and "egl" not in loaded, loaded


def test_the_command_reports_the_camera_that_flew(bare, tmp_path, capsys, monkeypatch) -> None:
    """The note goes to standard error, the summary names plane."""
    monkeypatch.setattr(sim.flight.side_by_side, "fly", fake_fly)
    words = ["paint", "--camera", "gl", "--law", "qp", "--json", "--no-video", "--out", str(tmp_path / "run")]
    assert cli.main(words) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["camera"] == "plane"
    assert err.count("\n") == 1 and err.startswith("ibvs-qp: --camera gl: no OpenGL")
