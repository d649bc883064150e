"""The picture: on a curved, leaning wall the board lies on the wall, and upwards is against gravity."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

pytest.importorskip("viser", reason="the extra live is not installed")

from sim.live.process import PAINT_PX_M
from sim.live.scene import Board
from sim.live.site import open_server, stop
from sim.world.board import BoardGeometry
from sim.world.mujoco_frames import FLIP
from sim.world.scene import Scene, SurfaceScene


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_the_strips_of_a_board_lie_on_the_wall_and_show_its_paint(free_port, axis):
    scene = dataclasses.replace(Scene(), surface=SurfaceScene(kind="cylinder", radius_m=2.0, lean_deg=5.0, axis=axis))
    server = open_server("127.0.0.1", free_port)
    try:
        board, geometry = Board(server, scene), BoardGeometry(scene)
        charts = geometry.surface.chart(np.array([FLIP * strip.position for strip in board._strips]))
        np.testing.assert_allclose(charts[:, 0], 0.0, atol=1e-9)
        spots = geometry.board_coordinates(charts[:, 1:])
        size = scene.board.width_m, scene.board.height_m
        assert np.all((spots > 0.0) & (spots < size))
        paint = np.zeros([round(PAINT_PX_M * each) for each in reversed(size)], np.uint8)
        paint[-1, 0] = 255  # bottom left
        board.show(paint)
        painted = [np.ptp(strip.image.astype(int), axis=(0, 1)).any() for strip in board._strips]
        lowest = int(np.argmin(spots[:, 0 if axis == "vertical" else 1]))
        assert painted == [index == lowest for index in range(len(painted))]
    finally:
        stop(server)
