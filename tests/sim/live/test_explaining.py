"""Explanation and what-if of a tick, its text, the log in the scene, the preset of the changes alone."""

from __future__ import annotations

import dataclasses
import multiprocessing
import re
import subprocess
import sys

import numpy as np
import pytest

import ibvs_qp
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import load_toml
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.pilot import PilotConfig
from sim.commands.live import Live
from sim.flight.closed_loop import ClosedLoop
from sim.flight.jobs import PressJob
from sim.live.explaining import CEILING, WhatIf
from sim.live.process import FlightProcess
from sim.live.rows import LiveLoop
from sim.live.session import Session, write_run
from sim.live.session_file import Start, changes_text
from sim.world.scene import Scene

SCENE = dataclasses.replace(Scene(), start=dataclasses.replace(Scene().start, distance_m=0.2))
START = Start(scene=SCENE, press=PressJob(hold_s=20.0))


def test_the_five_minutes_of_the_page():
    """docs/live.md as written: `--press 300`, a limit of 15 N, the button for an active limit, and the factor."""
    here, there = multiprocessing.Pipe()
    process = FlightProcess(there, Live(press=300.0)._start())
    session, loop = process.session, process.session.qp.loop
    assert isinstance(loop, LiveLoop)
    recorder, push = loop.recorder, loop.recorder.places["push"]
    while session.ticks < 2500:
        session.step()
    pushes = recorder.rows(0, 2500)[:, push]
    assert 7.5 < 0.004 * np.flatnonzero(pushes)[0] < 9.0  # touch
    assert pushes[-100:].mean() == pytest.approx(5.0, abs=0.2)
    session.change("thrust", {"thrust_max_n": 15.0})
    for _ in range(500):
        session.step()
    reduction = loop.pilot.push_report.reduction
    assert re.match(r"reach 2\.\d N of 5.0 N asked: standing still, mid_right at its upper limit of 15.0 N", reduction)
    assert 2.0 < recorder.rows(2800, 3000)[:, push].mean() < 3.0

    process._execute("limited")  # the button
    kind, back, tick, point = here.recv()
    assert kind == "found" and not process._running and 2500 <= tick == session.ticks - back
    what_if = WhatIf(straightened(loop.pilot.config.controller))
    assert what_if.explain(point) is not None
    ceiling, flown, same = what_if.scaled(point, CEILING, 1.0)
    assert ceiling == 15.0 and same is flown is not None
    active = [limit for limit in flown.active_limits if limit.name == "thrust_mid_right"]
    assert len(active) == 1 and active[0].side == "upper" and active[0].price > 0.0
    assert "| thrust_mid_right | upper 15 N |" in what_if.markdown(point, same, flown)
    for factor in (0.9, 1.2):
        value, flown, now = what_if.scaled(point, CEILING, factor)
        assert now is not None and flown is not None and value == pytest.approx(15.0 * factor)
        assert np.abs(now.thrusts - flown.thrusts).max() > 1e-3
    assert now.thrusts[0] > 15.0  # further room is used


@pytest.fixture(scope="module")
def flown() -> Session:
    """A session with a changed weight."""
    session = Session(START)
    session.change("set", {"weights.push": 0.2})
    for _ in range(200):
        session.step()
    return session


def test_a_tick_is_explained_as_recorded_and_with_a_lower_ceiling(flown):
    loop = flown.qp.loop
    assert isinstance(loop, LiveLoop)
    point, row = loop.recorder.point(150), loop.recorder.rows(150, 151)[0]
    what_if = WhatIf(straightened(loop.pilot.config.controller))
    recorded = what_if.explain(point)
    assert recorded is not None
    np.testing.assert_allclose(recorded.thrusts, row[loop.recorder.places["thrusts"]], atol=1e-3)
    assert what_if.settings(point)["weights.push"] == 0.2
    ceiling = float(recorded.thrusts.max()) - 0.5
    capped = what_if.explain(point, {CEILING: ceiling})
    assert capped is not None and capped.active_limits
    assert capped.thrusts.max() == pytest.approx(ceiling, abs=1e-6)
    assert capped.active_limits[0].name in what_if.markdown(point, capped, recorded)
    for values in ({"weights.pull": 1.0}, {"weights.push": float("nan")}):
        with pytest.raises(ConfigError):
            what_if.explain(point, values)


def test_a_preset_has_the_changes_alone(tmp_path):
    config = ibvs_qp.preset("qp")
    controller = dataclasses.replace(
        config.controller, weights=dataclasses.replace(config.controller.weights, push=0.125)
    )
    file = tmp_path / "preset.toml"
    file.write_text(changes_text(dataclasses.replace(config, controller=controller), config.painting, 15.0))
    assert load_toml(PilotConfig, file).controller.weights.push == 0.125
    assert "limit of 15 N is in session.json" in file.read_text()
    assert [line for line in file.read_text().splitlines() if line and line[0] != "#"] == [
        "[controller.weights]",
        "push = 0.125",
    ]


def test_a_log_has_the_rows_and_programs_of_its_flight(tmp_path):
    pytest.importorskip("viser", reason="the extra live is not installed")
    from sim.live.log_scene import LoggedFlight

    session = Session(START, kind=ClosedLoop)
    for _ in range(100):
        session.step()
    write_run(tmp_path, session)
    flight = LoggedFlight(tmp_path)
    assert len(flight.rows) == len(flight.points) == 100
    explained = WhatIf(straightened(flight.config.controller)).explain(flight.points[60])
    assert explained is not None
    np.testing.assert_allclose(explained.thrusts, flight.rows[60, flight.places["thrusts"]], atol=1e-3)
    with pytest.raises(ConfigError):
        LoggedFlight(tmp_path / "nothing.mcap")


def test_a_run_folder_needs_no_mcap():
    pytest.importorskip("viser", reason="the extra live is not installed")
    code = "import sys; sys.modules['mcap'] = None; import sim.live.log_scene"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_an_mcap_log_has_the_same_programs_as_far_as_memory_goes(tmp_path, monkeypatch):
    for module in ("viser", "mcap"):
        pytest.importorskip(module, reason=f"the extra of {module} is not installed")
    from sim.live import log_scene

    options = dataclasses.replace(START.options("qp"), mcap=True, journal=str(tmp_path))
    loop = ClosedLoop(SCENE, options, START.config("qp"), START.job)
    for _ in range(100):
        loop.sense()
        loop.advance()
    loop.close()
    trace, flight = loop.trace(), log_scene.LoggedFlight(tmp_path / "qp.mcap")
    assert len(flight.rows) == len(flight.points) == 100 and not flight.note
    np.testing.assert_allclose(flight.rows[:, flight.places["thrusts"]], trace.thrusts, atol=1e-6)
    explained = WhatIf(straightened(flight.config.controller)).explain(flight.points[60])
    assert explained is not None
    np.testing.assert_allclose(explained.thrusts, trace.thrusts[60], atol=1e-3)
    monkeypatch.setattr(log_scene, "_MOST_BYTES", 8 * 40 * (flight.rows.shape[1] + flight.points.shape[1]))
    cut = log_scene.LoggedFlight(tmp_path / "qp.mcap")
    assert len(cut.rows) == 40 and "40 ticks" in cut.note
