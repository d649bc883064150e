"""SIGTERM is Ctrl-C: at once, or as soon as Ctrl-C is no longer ignored."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest

from sim.flight.stop import handled_ctrl_c, sigterm_as_ctrl_c


@pytest.fixture(autouse=True)
def deaf() -> Iterator[None]:
    """Without the handler SIGTERM would end the tests: here it is ignored, and the tests see that nothing came."""
    previous = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGTERM, previous)


def terminate() -> None:
    os.kill(os.getpid(), signal.SIGTERM)


def test_sigterm_interrupts_and_is_told_from_ctrl_c() -> None:
    with sigterm_as_ctrl_c() as came:
        assert not came()
        with pytest.raises(KeyboardInterrupt):
            terminate()
        assert came()
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN, "as before"
    with sigterm_as_ctrl_c() as came:
        assert not came(), "of another run"


def test_sigterm_calls_the_handler_of_ctrl_c() -> None:
    seen: list[int] = []
    with sigterm_as_ctrl_c() as came, handled_ctrl_c(lambda number, frame: seen.append(number)):
        terminate()
        assert seen == [signal.SIGINT] and came()


def test_sigterm_waits_while_ctrl_c_is_ignored() -> None:
    with sigterm_as_ctrl_c() as came, pytest.raises(KeyboardInterrupt):
        with handled_ctrl_c(signal.SIG_IGN):
            terminate()
            assert came()
            waited = True
        raise AssertionError("the signal was lost")
    assert waited
