"""The picture from outside: things appear where the camera's geometry puts them, nearer ones in front."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_trace import synthetic_trace

from sim.video.outside import OutsideView, flown_vehicle, scene_points, vehicle_pose
from sim.video.rasterizer import OVERSAMPLING, OutsideCamera, Rasterizer, Triangles
from sim.world.board import BoardGeometry
from sim.world.mjcf import build_model
from sim.world.mujoco_frames import FLIP
from sim.world.scene import BoardScene, PaintScene, Scene

SCENE = Scene(paint=PaintScene(stroke_m=0.6, color=(20, 60, 220)), board=BoardScene(width_m=0.9, clutter=0))
SIZE = (640, 400)


@pytest.fixture(scope="module")
def trace():
    return synthetic_trace(scene=SCENE)


@pytest.fixture(scope="module")
def camera(trace):
    return OutsideCamera.framing(scene_points(trace), SIZE)


def square(camera: OutsideCamera, place: np.ndarray, half_m: float, colour: tuple[float, float, float]) -> Triangles:
    """A square that faces the camera."""
    right, up, backward = camera.axes
    points = place + half_m * np.array([-right - up, right - up, right + up, -right + up])
    normals, colours = np.tile(backward, (4, 1)), np.tile(colour, (4, 1))
    return Triangles(points, normals, colours, np.array([(0, 1, 2), (0, 2, 3)], np.int32))


@given(across=st.floats(-0.4, 0.4), along=st.floats(-0.6, 0.4), up=st.floats(0.9, 1.5))
def test_a_point_is_drawn_where_the_projection_says(camera, along, across, up):
    place = np.array([along, across, up])
    drawer = Rasterizer(camera)
    drawer.draw(square(camera, place, 0.02, (1.0, 1.0, 1.0)))
    rows, columns = np.nonzero(drawer.colour[..., 0])
    seen = (np.array([columns.mean(), rows.mean()]) + 0.5) / OVERSAMPLING
    assert np.abs(seen - camera.project(place)[0]).max() < 0.3


def test_the_nearer_thing_is_in_front_whatever_is_drawn_first(camera):
    place, towards = np.array([-0.3, 0.0, 1.2]), camera.axes[2]
    near = square(camera, place + 0.3 * towards, 0.03, (1.0, 0.0, 0.0))
    far = square(camera, place, 0.03, (0.0, 1.0, 0.0))
    column, row = (OVERSAMPLING * camera.project(place)[0]).astype(int)
    for order in ((near, far), (far, near)):
        drawer = Rasterizer(camera)
        for surface in order:
            drawer.draw(surface)
        red, green, _ = drawer.colour[row, column]
        assert red > 0.3 and green == 0.0


def test_everything_of_the_flight_is_in_the_picture_and_fills_it(trace, camera):
    seen = camera.project(scene_points(trace))
    assert (seen > 0).all() and (seen < SIZE).all()
    assert (np.ptp(seen, axis=0) / SIZE).max() > 0.85


def test_the_vehicle_is_where_the_log_says(trace, camera):
    """Pixels that differ from the empty scene lie about the hub, the rotors and the tip, and nowhere above them."""
    view, tick = OutsideView(trace, camera), 10
    background = view.background()
    changed = np.abs(view.draw(tick).astype(int) - background).max(axis=-1) > 60
    vehicle = flown_vehicle(trace)
    pose = vehicle_pose(trace, tick)
    rotors = FLIP * vehicle.geometry.positions @ pose[:3, :3].T + pose[:3, 3]
    motors = camera.project(np.vstack((pose[:3, 3], rotors - 0.024 * pose[:3, 2])))
    for column, row in np.rint(motors).astype(int):
        assert changed[row - 4 : row + 5, column - 4 : column + 5].any()
    tip = FLIP * trace.tip[tick]
    back = camera.project(tip - np.array([0.02, 0.0, 0.0]))[0].astype(int)
    assert changed[back[1], back[0]], "the brush stands behind the tip"
    reach = camera.project(scene_points(trace)[4:])
    assert not changed[: int(reach[:, 1].min()) - 5].any()


def test_the_tip_of_the_pose_is_the_logged_tip(trace):
    vehicle = flown_vehicle(trace)
    for tick in (0, 900, len(trace.t) - 1):
        pose = vehicle_pose(trace, tick)
        place = pose[:3, :3] @ (FLIP * vehicle.tip_position_m) + pose[:3, 3]
        assert np.allclose(FLIP * place, trace.tip[tick], atol=1e-12)


def test_a_pose_is_that_of_the_body_and_not_of_a_tip_in_the_chart_of_a_round_wall(trace):
    bent = dataclasses.replace(trace, arrays=trace.arrays | {"tip": trace.tip + np.array((0.0, 0.1, 0.0))})
    assert np.array_equal(FLIP * vehicle_pose(bent, 900)[:3, 3], trace.position[900])


def test_paint_appears_where_the_brush_has_pressed_and_not_before(trace, camera):
    view, geometry = OutsideView(trace, camera), BoardGeometry(SCENE)
    _, right = geometry.row_ends
    board = FLIP * np.append(0.0, geometry.point(right, geometry.row_height(1)))
    column, row = np.rint(camera.project(board)[0]).astype(int)
    view.draw(10)
    before = view.background()[row, column].astype(int)
    view.draw(len(trace.t) - 1)
    after = view.background()[row, column].astype(int)
    assert np.ptp(before) < 40, "a bare, light board"
    assert after[2] > after[0] + 80, "blue paint"


def test_a_drawn_vehicle_moves_like_a_bare_one():
    """Geoms for display have no mass and no contact."""
    vehicle = flown_vehicle(synthetic_trace(scene=SCENE))
    drawn, bare = (build_model(SCENE, vehicle, drawn=shown)[0] for shown in (True, False))
    assert drawn.ngeom > bare.ngeom
    assert np.array_equal(drawn.body_mass, bare.body_mass)
    assert np.array_equal(drawn.body_inertia, bare.body_inertia)
