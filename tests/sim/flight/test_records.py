"""Records of a flight: rows on the disk, tables, checks of a log, and Ctrl-C in the middle of a tick."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from closed_loop_rigs import short_scene
from synthetic_trace import LIMITS, OUTCOMES, PHASES, synthetic_trace

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.symbolic.function import BoundFunction
from sim.evaluate.metrics import compute_metrics
from sim.flight.assemble import euler_angles, in_body, rotations
from sim.flight.closed_loop import fly
from sim.flight.journal import Columns, Header, Journal
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.flight.trace import Trace
from sim.flight.unfinished import check_arrays
from sim.world.board import BoardGeometry
from sim.world.clearance import PropellerClearance
from sim.world.plant import Plant
from sim.world.random_streams import BLOCK, NormalRows, Normals, stream
from sim.world.scene import BoardScene, Scene, StartScene


@pytest.mark.parametrize("entry", [500, 501])
def test_a_half_written_tick_is_dropped(monkeypatch: pytest.MonkeyPatch, entry: int) -> None:
    """Once between the log's row and the program's, once before the log's row was there."""
    add, count = Columns.add, 0

    def interrupted(self: Columns, *parts: np.ndarray):
        nonlocal count
        count += 1
        if count == entry:
            raise KeyboardInterrupt
        return add(self, *parts)

    monkeypatch.setattr(Columns, "add", interrupted)
    trace = fly(Scene(), FlightOptions(features="geometric", video=False))
    assert trace.reason == "interrupted"
    assert {len(trace.t), len(trace.tip), len(trace.active), len(trace.contact_1khz) // 4} == {len(trace.t)}
    assert compute_metrics(trace)["completed"] is False


def test_a_chunk_is_on_the_disk_at_once(tmp_path: Path) -> None:
    header = Header(law="qp", seed=3, scene="", preset="", columns={"t": 1, "tip": 3}, program=2)
    journal = Journal(tmp_path / "partial", header)
    rows, notes = tmp_path / "partial" / "qp.rows", tmp_path / "partial" / "qp.jsonl"
    assert json.loads(notes.read_text())["seed"] == 3
    for count in (1, 2):
        journal.append([np.arange(4.0)] * 25, [np.ones(2)] * 25, {"ticks": 25})
        assert rows.stat().st_size == count * 25 * header.row.itemsize
        assert len(notes.read_text().splitlines()) == 1 + count
    found = np.fromfile(rows, header.row)
    assert (found["log"] == np.arange(4.0)).all() and (found["program"] == 1.0).all()
    journal.close()


NAMES = {"phases": np.array(PHASES), "outcomes": np.array(OUTCOMES), "limits": np.array(LIMITS)}
SOUND = synthetic_trace().arrays | NAMES


def changed(name: str, place: int, value: float) -> dict[str, Any]:
    array = SOUND[name].copy()
    array[place] = value
    return SOUND | {name: array}


def test_sound_arrays_pass() -> None:
    check_arrays(SOUND)


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0, SOUND["t"][9], SOUND["t"][12]])
def test_a_time_that_does_not_increase_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="array t does not increase"):
        check_arrays(changed("t", 10, value))


@pytest.mark.parametrize(("name", "value"), [("phase", len(PHASES)), ("phase", -1), ("outcome", len(OUTCOMES))])
def test_an_index_without_a_name_is_refused(name: str, value: int) -> None:
    with pytest.raises(ValueError, match=f"array {name} has an index outside {name}s"):
        check_arrays(changed(name, 3, value))


@pytest.mark.parametrize("names", ["phases", "outcomes", "limits"])
@pytest.mark.parametrize("array", [np.zeros((1, 0)), np.array([["a", "b"]]), np.array("a"), np.arange(30)])
def test_names_that_are_no_list_of_text_are_refused(names: str, array: np.ndarray) -> None:
    with pytest.raises(ValueError, match=f"array {names} has shape"):
        check_arrays(SOUND | {names: array})


def test_noise_in_blocks_is_the_noise_drawn_one_by_one() -> None:
    normals, plain = Normals(stream(3, "gyro")), stream(3, "gyro")
    sizes = [3, 1, 6, BLOCK + 5, 2] * 60
    for size in sizes:
        np.testing.assert_array_equal(normals.take(size), plain.standard_normal(size))


def test_rows_come_back_in_order() -> None:
    table = Columns({"one": 1, "three": 3})
    assert table.arrays()["one"].shape == (0,) and table.arrays()["three"].shape == (0, 3)
    for k in range(20):
        table.add(np.array((k, 10.0 * k)), np.array((20.0 * k, 30.0 * k)))
    arrays = table.arrays()
    np.testing.assert_array_equal(arrays["one"], np.arange(20))
    np.testing.assert_array_equal(arrays["three"], np.outer(np.arange(20), (10, 20, 30)))
    assert len(table) == 20


def test_truth_of_the_log_is_what_the_plant_tells() -> None:
    scene = Scene(board=BoardScene(slope_deg=4.0, gap_m=0.08), start=StartScene(distance_m=1.0, yaw_deg=5.0))
    plant, rng = Plant(scene, seed=2), np.random.default_rng(0)
    motion, told = [], []
    for _ in range(80):
        plant.step(plant.thrusts_actual + rng.normal(size=6))
        motion.append(plant.motion)
        told.append(np.concatenate((plant.euler, plant.velocity, [plant.propeller_clearance])))
    logged, told = np.array(motion), np.array(told)
    rotation = rotations(logged[:, 6:10])
    np.testing.assert_allclose(euler_angles(rotation), told[:, :3], atol=1e-12)
    np.testing.assert_allclose(in_body(rotation, logged[:, 3:6]), told[:, 3:6], atol=1e-12)
    clearance = PropellerClearance(BoardGeometry(scene), VehicleParams())
    np.testing.assert_allclose(clearance.distances(logged[:, :3], rotation), told[:, 6], atol=1e-12)


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
