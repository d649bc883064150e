"""Shared and lazy parts of a flight: textures drawn on access, noise in blocks, objects made at once."""

from __future__ import annotations

import pickle

import casadi as ca
import numpy as np
import pytest
from closed_loop_rigs import short_scene

from ibvs_qp.symbolic.function import BoundFunction
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.flight.trace import Trace
from sim.world.random_streams import NormalRows, stream


def test_without_a_camera_nothing_is_drawn_before_access() -> None:
    scene, options = short_scene(stroke_m=0.2, rows=1), FlightOptions(features="geometric", video=False)
    world = World(scene, options, pilot_config(scene, options))
    for _ in range(20):
        world.sense()
        world.act(world.plant.thrusts_actual)
    world.canvas.stroke(None, (0.1, 0.1))
    assert not {"_blank", "_fresh", "texture", "_wall"} & set(world.canvas.__dict__)
    trace = Trace(scene=scene, seed=0, law="qp")
    assert trace.canvas is None
    trace.draw_later(lambda: world.canvas.rgb)
    copy = pickle.loads(pickle.dumps(trace))
    np.testing.assert_array_equal(copy.canvas, world.canvas.rgb)
    assert trace.canvas is trace.canvas, "drawn once"


def test_noise_in_rows_is_the_noise_one_by_one() -> None:
    rows = NormalRows((stream(3, "a"), stream(3, "b")), 3)
    a, b = stream(3, "a"), stream(3, "b")
    for _ in range(400):
        expected = np.concatenate(([a.standard_normal() for _ in range(3)], [b.standard_normal() for _ in range(3)]))
        np.testing.assert_array_equal(rows.take(), expected)


def test_a_bound_function_works_in_place_and_refuses_what_would_be_a_copy() -> None:
    x = ca.SX.sym("x", 3)
    function = ca.Function("twice", [x], [2.0 * x])
    memory, out = np.arange(8.0), np.zeros(3)
    twice = BoundFunction(function, (memory[2:5],), (out,))
    memory[2] = 10.0
    twice()
    assert out.tolist() == [20.0, 6.0, 8.0]
    for wrong in (memory[::2][:3], np.arange(3), np.zeros(4)):
        with pytest.raises(ValueError, match="array"):
            BoundFunction(function, (wrong,), (out,))
