"""The board ends where it ends: beside it the tip meets no board, but the wall behind."""

import numpy as np
import pytest
from plants import at_rest

from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.world.board import BoardGeometry
from sim.world.face import TIP_RADIUS_M
from sim.world.plant import Plant
from sim.world.scene import BoardScene, Scene, WallScene

SCENE = Scene(board=BoardScene(slope_deg=6.0, gap_m=0.03), wall=WallScene(damping_n_s_m=0.0))
BOARD = BoardGeometry(SCENE)
WIDTH, HEIGHT = SCENE.board.width_m, SCENE.board.height_m
#: Middles of the four edges as (along, up) [m], and the way out.
EDGES = (
    ((0.0, 0.5 * HEIGHT), (-1.0, 0.0)),
    ((WIDTH, 0.5 * HEIGHT), (1.0, 0.0)),
    ((0.5 * WIDTH, 0.0), (0.0, -1.0)),
    ((0.5 * WIDTH, HEIGHT), (0.0, 1.0)),
)


def move(plant: Plant, place: np.ndarray, depth: float) -> Plant:
    """Put the tip before a place of the board (along, up), so deep behind its face [m], and let a tick pass."""
    tip = np.append(depth, BOARD.point(*place))
    at_rest(plant, tip - np.array(plant.vehicle.tip_position_m)).step(plant.thrusts_actual)
    return plant


@pytest.mark.parametrize(("edge", "outward"), EDGES)
def test_tip_beside_the_board_meets_the_wall_and_not_the_board(edge, outward):
    plant, stiffness = Plant(SCENE), SCENE.wall.stiffness_n_m
    for beyond, depth, push in (
        (-0.002, 0.003, 0.003),
        (0.002, 0.003, 0.0),
        (0.002, 0.029, 0.0),
        (0.002, 0.033, 0.003),
    ):
        move(plant, np.array(edge) + beyond * np.array(outward), depth)
        assert plant.on_board == (beyond < 0.0) and plant.crashed is None
        assert plant.pushes[0] == pytest.approx(stiffness * push, rel=0.02, abs=1e-9)


@pytest.mark.parametrize(("deeper", "struck"), [(0.9 * TIP_RADIUS_M, False), (1.1 * TIP_RADIUS_M, True)])
def test_tip_that_comes_back_deeper_than_its_radius_strikes_the_boards_edge(deeper, struck):
    plant = Plant(SCENE)
    for beyond, depth in ((-0.002, 0.003), (0.002, 0.003), (-0.002, 0.003 + deeper)):
        move(plant, np.array([-beyond, 0.3]), depth)
    assert (plant.crashed == "tip struck the board's edge") == struck


def test_a_brush_that_presses_the_wall_beside_the_board_paints_nothing():
    options = FlightOptions(features="geometric")
    for beyond, depth in ((-0.002, 0.003), (0.002, 0.033)):
        world = World(SCENE, options, pilot_config(SCENE, options))
        move(world.plant, np.array([-beyond, 0.3]), depth)
        world.act(world.plant.thrusts_actual)
        assert world.plant.contact_normal_force > 1.0
        assert bool(world.canvas.coverage.any()) == (beyond < 0.0), "the brush's disc reaches over the board's rim"
