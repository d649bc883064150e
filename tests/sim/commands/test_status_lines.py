"""Lines of a status: the loop goes on whatever the terminal does."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator

import pytest

import sim.commands.bridge as status_lines
from sim.commands.bridge import StatusLines


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    ends = os.pipe()
    yield ends
    for end in ends:
        os.close(end)


def test_the_last_lines_are_written(pipe: tuple[int, int]) -> None:
    lines = StatusLines(pipe[1])
    lines.put("first")
    assert os.read(pipe[0], 100) == b"first\n"
    lines.close("a\nb")
    assert os.read(pipe[0], 100) == b"a\nb\n"


def test_lines_that_come_faster_than_they_are_read_are_dropped(pipe: tuple[int, int]) -> None:
    lines = StatusLines(pipe[1])
    for number in range(100_000):
        lines.put(str(number))
    lines.close("end")
    text = os.read(pipe[0], 100_000).decode().splitlines()
    assert len(text) < 100 and text[-1] == "end"


@pytest.mark.timeout(10)
def test_a_stopped_terminal_does_not_stop_the_loop(pipe: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(status_lines, "LAST_S", 0.1)
    room = fcntl.fcntl(pipe[1], fcntl.F_GETPIPE_SZ)
    os.write(pipe[1], bytes(room))
    lines, begin = StatusLines(pipe[1]), time.monotonic()
    for _ in range(1000):
        lines.put("x" * 1000)
    lines.close("end")
    assert time.monotonic() - begin < 1.0
    os.read(pipe[0], room)  # so that the thread ends


def test_lines_go_on_after_an_error_of_the_output(pipe: tuple[int, int]) -> None:
    room = fcntl.fcntl(pipe[1], fcntl.F_GETPIPE_SZ)
    os.set_blocking(pipe[1], False)
    os.write(pipe[1], bytes(room))
    lines = StatusLines(pipe[1])
    lines.put("refused")
    while lines._newest:
        time.sleep(0.01)
    time.sleep(0.05)
    os.read(pipe[0], room)
    lines.close("end")
    os.set_blocking(pipe[0], False)
    assert os.read(pipe[0], 100).endswith(b"end\n")
