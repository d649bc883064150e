"""The analytic law in its process flies the same ticks as beside the QP law in one process, also after a rewind."""

from __future__ import annotations

import dataclasses
import multiprocessing
import time

import numpy as np
import pytest

from sim.flight.jobs import PressJob
from sim.live.ghost import BEHIND_TICKS, SHARED, Ghost, follow
from sim.live.rows import LiveLoop
from sim.live.session import Session, ghost_flight
from sim.live.session_file import Start
from sim.world.scene import Scene

SCENE = dataclasses.replace(Scene(), start=dataclasses.replace(Scene().start, distance_m=0.2))
START = Start(scene=SCENE, press=PressJob(hold_s=20.0))
#: Longest wait for its process [s].
PATIENCE_S = 120.0


@pytest.fixture
def ghost():
    """A ghost, its process, and what it shares."""
    context = multiprocessing.get_context("spawn")
    (here, there), shared = context.Pipe(), context.RawArray("d", SHARED)
    process = context.Process(target=follow, args=(there, START, shared), daemon=True)
    process.start()
    there.close()
    found = Ghost(here, shared)
    yield found, process, shared
    found.close()
    process.join(PATIENCE_S)
    assert not process.is_alive()


def fly(session: Session) -> None:
    for _ in range(100):
        session.step()
    session.change("thrust", {"thrust_max_n": 20.0})
    for _ in range(60):
        session.step()
    session.rewind(90)
    for _ in range(40):
        session.step()


@pytest.mark.slow
def test_a_ghost_flies_what_it_would_in_the_same_process(ghost):
    found, process, shared = ghost
    beside = ghost_flight(START)
    assert found.pose is None
    fly(Session(START, beside))
    fly(Session(START, found))
    end = time.monotonic() + PATIENCE_S
    while shared[0] != 130.0:
        assert time.monotonic() < end and process.is_alive()
        time.sleep(0.01)
    loop = beside.loop
    assert isinstance(loop, LiveLoop)
    row, places = loop.recorder.rows(129, 130)[0], loop.recorder.places
    np.testing.assert_array_equal(np.concatenate(found.pose), [*row[places["position"]], *row[places["quaternion"]]])


@pytest.mark.slow
def test_the_flight_ends_with_its_ghost(ghost):
    found, process, _ = ghost
    process.kill()
    process.join()
    with pytest.raises((EOFError, ConnectionError)):
        for _ in range(BEHIND_TICKS + 2):
            found.step()
