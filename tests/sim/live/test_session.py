"""A session: rewound ticks and repeated files are the same bits, changes act at the next tick, memory is bounded."""

from __future__ import annotations

import dataclasses
import gc
import json
import math
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import UnreadableFile
from sim.commands.live import Live
from sim.flight.closed_loop import ClosedLoop
from sim.flight.jobs import PressJob
from sim.live.process import FlightProcess
from sim.live.rows import MOST_EVENTS, LiveLoop
from sim.live.session import SNAPSHOTS, Session, ghost_flight, repeat
from sim.live.session_file import SessionFile, Start
from sim.live.snapshot import Blocks, WorldState
from sim.world.scene import Scene

#: A scene next to the wall shortens the approach.
SCENE = dataclasses.replace(Scene(), start=dataclasses.replace(Scene().start, distance_m=0.2))
START = Start(scene=SCENE, press=PressJob(hold_s=20.0))
PUSH = {"kind": "SidePush", "force_n": [0.0, 4.0, 0.0], "duration_s": 0.3}


def fly(session: Session, ticks: int) -> None:
    """Fly some ticks."""
    for _ in range(ticks):
        session.step()


def test_a_flight_rewound_and_changed_alike_is_the_same_in_both_laws():
    ghost = ghost_flight(START)
    session = Session(START, ghost)
    fly(session, 300)
    session.change("set", {"weights.push": 0.2})
    fly(session, 150)
    session.change("fault", PUSH)
    session.change("task", {"push_n": 7.0})
    fly(session, 200)
    first = session.file(), ghost.digest.hexdigest()
    session.rewind(400)
    assert session.ticks == ghost.loop.ticks == 400
    assert [change.kind for change in session.changes] == ["set"]
    fly(session, 50)
    session.change("fault", PUSH)
    session.change("task", {"push_n": 7.0})
    fly(session, 200)
    assert (session.file(), ghost.digest.hexdigest()) == first


def unreachable() -> int:
    """Objects that only a collection of cycles frees, after 500 ticks of both laws, of these two with a snapshot."""
    session = Session(START, ghost_flight(START))
    fly(session, 300)
    gc.collect()
    gc.disable()
    fly(session, 500)
    return gc.collect()


def test_ticks_and_snapshots_leave_no_cycles_of_references():
    """The processes of live collect in a pause only. In a process of its own: threads of other tests make cycles."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        assert pool.submit(unreachable).result() == 0


def test_a_fork_goes_another_way_and_its_file_repeats_it(tmp_path):
    session = Session(START)
    fly(session, 520)
    straight = session.file().digest
    session.rewind(260)
    session.change("set", {"limits.tilt_deg": 0.3, "weights.line": 2.0})
    fly(session, 260)
    forked = session.file()
    assert forked.digest != straight
    forked.write(tmp_path / "session.json")
    again = SessionFile.read(tmp_path / "session.json")
    assert again == forked
    for kind in (LiveLoop, ClosedLoop):
        assert repeat(again, kind).file().digest == forked.digest


def test_rendered_pictures_rewind_too():
    session = Session(dataclasses.replace(START, features="rendered"))
    fly(session, 300)
    straight = session.file().digest
    session.rewind(120)
    fly(session, 180)
    assert session.file().digest == straight


def test_the_solver_changes_and_is_back_after_a_rewind():
    session = Session(START)
    fly(session, 260)
    session.change("set", {"solver.name": "daqp"})
    fly(session, 260)
    assert session.qp.loop.command is not None and session.qp.loop.command.outcome == "solved"
    digest = session.file().digest
    session.rewind(100)
    fly(session, 160)
    session.change("set", {"solver.name": "daqp"})
    fly(session, 260)
    assert session.file().digest == digest


def test_a_weight_acts_at_the_next_tick():
    one, other = Session(START), Session(START)
    for session in (one, other):
        fly(session, 100)
    other.change("set", {"weights.level": 0.5})
    for session in (one, other):
        session.step()
    thrusts = [session.qp.loop.recorder.rows(100, 101)[0] for session in (one, other)]  # type: ignore[attr-defined]
    place = one.qp.loop.recorder.places["thrusts"]  # type: ignore[attr-defined]
    assert not np.array_equal(thrusts[0][place], thrusts[1][place])


def test_a_thrust_limit_acts_at_the_next_tick_and_leaves_a_lost_rotor_off():
    session = Session(START)
    fly(session, 100)
    loop, (lower, upper) = session.qp.loop, session.qp.loop.world.plant.thrust_limits
    upper[1] = 0.0  # lost, and not reported
    loop.world.plant.thrust_limits = np.minimum(lower, upper), upper
    for ceiling in (10.5, 52.56):
        session.change("thrust", {"thrust_max_n": ceiling})
        session.step()
        assert loop.pilot.measurement is not None and loop.pilot.measurement.thrust_max is not None
        expected = [ceiling, 0.0, *[ceiling] * 4]
        assert loop.pilot.measurement.thrust_max.tolist() == expected
        assert loop.world.plant.thrust_limits[1].tolist() == expected


@pytest.mark.parametrize(
    ("kind", "values", "named"),
    [
        ("thrust", {"thrust_max_n": math.nan}, "thrust_max_n"),
        ("thrust", {"thrust_max_n": 5.0}, "allowed is 9.81"),
        ("thrust", {"thrust_max_n": "full"}, "one number"),
        ("thrust", {"push_n": 20.0}, "one number"),
        ("set", {"weights.push": float("nan")}, "weights.push"),
        ("set", {"weights.pull": 1.0}, "weights.pull"),
        ("set", {"solver.name": "abacus"}, "abacus"),
        ("task", {"push_n": 1e9}, "push_n"),
        ("task", {"rows": 3}, "rows"),
        ("set", {"solver.name": ["osqp"]}, "solver.name"),
        ("set", {"weights.push": 0.2, "solver.name": "abacus"}, "abacus"),
        ("set", {"weights.pull": 1.0, "solver.name": "daqp"}, "weights.pull"),
        ("fault", {"kind": "Meteor"}, "Meteor"),
        ("fault", {"kind": ["Derate"]}, "Derate"),
        ("fault", {"kind": "Derate", "rotor": "tail"}, "tail"),
        ("fault", {"kind": "SidePush", "force_n": [0.0, 1e9, 0.0]}, "force_n"),
        ("dance", {}, "dance"),
    ],
)
def test_refused_changes_change_nothing(kind, values, named):
    session = Session(START)
    law, solver = session.qp.loop.pilot.controller, session.qp.solver
    config, engine = law.config, law.engine  # type: ignore[attr-defined]
    with pytest.raises(ConfigError, match=named):
        session.change(kind, values)
    assert session.changes == []
    assert (law.config, session.qp.solver) == (config, solver) and law.engine is engine  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "damage",
    [
        {"schema": 2},
        {"seed": -1},
        {"ticks": 1e3},
        {"changes": [{"tick": 1}]},
        {"press": 3},
        {"changes": [{"tick": 1, "kind": ["set"], "values": {}}]},
    ],
)
def test_damaged_files_are_refused(tmp_path, damage):
    file = tmp_path / "session.json"
    SessionFile(start=START, changes=(), ticks=0, digest="").write(file)
    file.write_text(json.dumps(json.loads(file.read_text()) | damage))
    with pytest.raises(UnreadableFile, match="no session"):
        SessionFile.read(file)


def test_snapshots_and_rows_are_bounded():
    session = Session(START)
    recorder = session.qp.loop.recorder  # type: ignore[attr-defined]
    for _ in range(SNAPSHOTS + 5):
        session.qp._keep()
    assert len(session.qp._snapshots) == SNAPSHOTS
    assert recorder._rows.nbytes + recorder._points.nbytes < 50e6


def test_large_arrays_share_unchanged_blocks():
    blocks, array = Blocks(), np.zeros((640, 1024))
    first, _ = blocks.copy(array), blocks.end()
    second, _ = blocks.copy(array), blocks.end()
    array[5] = 1.0
    third = blocks.copy(array)
    assert all(one is two for one, two in zip(first, second, strict=True))
    assert [one is two for one, two in zip(second, third, strict=True)].count(False) == 1
    blocks._last = {id(array): first[:3]}  # of a gone array with the same number
    assert len(blocks.copy(array)) == len(first)
    state = WorldState(([array],), (), blocks)
    assert list(blocks._last) == [id(array)]
    WorldState(([],), (), blocks)
    assert not blocks._last
    array[:] = 2.0
    state.restore()
    assert np.array_equal(array[5], np.ones(1024)) and not array[6:].any()


def test_of_many_events_none_is_lost():
    recorder = Session(START).qp.loop.recorder  # type: ignore[attr-defined]
    sent, texts = 0, []
    for index in range(2 * MOST_EVENTS):
        recorder.note(0.0, "fault", str(index))
        if index % 7 == 0:
            texts += [event.text for event in recorder.events_since(sent)]
            sent = recorder.noted
    assert texts == [str(index) for index in range(sent)]


def test_a_session_flown_again_prints_json(tmp_path, capsys):
    session = Session(START)
    fly(session, 5)
    session.file().write(tmp_path / "session.json")
    assert Live(replay=tmp_path / "session.json", json=True).run([]) == 0
    assert json.loads(capsys.readouterr().out) == {"schema": 1, "ticks": 5, "changes": 0, "identical": True}


def test_a_rate_that_is_no_number_is_refused():
    here, there = multiprocessing.Pipe()
    process = FlightProcess(there, START)
    process._execute("rate", math.nan)
    assert here.recv()[0] == "refused" and math.isfinite(process._pace.rate)
