"""Output that cannot be written ends in one line, and a closed one in silence; names of files that no system takes."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from contract_schema import refusal

import sim.commands.bridge as status_lines
from sim.commands.bridge import StatusLines

PLAN = ("faults", "--plan", "--quick", "--rows", "F/T zero")


def run(words: tuple[str, ...], **streams: object) -> tuple[int, str]:
    command = [sys.executable, "-c", "import sys; from sim.commands.cli import main; sys.exit(main())", *words]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    found = subprocess.run(command, stderr=subprocess.PIPE, text=True, env=environment, **streams)  # type: ignore[call-overload]
    return found.returncode, found.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("words", [PLAN, ("--version",), ("compare", "--help")])
def test_full_output(words: tuple[str, ...]) -> None:
    with open("/dev/full", "w") as full:
        code, err = run(words, stdout=full)
    assert (code, err) == (2, "ibvs-qp: error: the disk or the output: No space left on device\n")


@pytest.mark.parametrize("words", [PLAN, ("--version",), ("compare", "--help")])
def test_a_reader_that_left(words: tuple[str, ...]) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    code, err = run(words, stdout=writer)
    os.close(writer)
    assert (code, err) == (2, "ibvs-qp: error: the disk or the output: Broken pipe\n")


@pytest.mark.slow
@pytest.mark.parametrize("words", [PLAN, ("compare", "--help")])
def test_closed_output(words: tuple[str, ...]) -> None:
    assert run(words, preexec_fn=lambda: os.close(1)) == (0, "")


CAMERA = "--fx 600 --fy 600 --cx 320 --cy 240".split()


@pytest.mark.parametrize(
    "words",
    [
        "paint --scene FILE",
        "paint --preset FILE",
        "paint --world FILE",
        "paint --out FILE",
        "faults --plan --world FILE",
        "experiment approach --plan --quick --world FILE",
        "experiment approach --quick --json --out FILE",
        "compare FILE FILE",
        "explain FILE --at 1",
        "sweep FILE",
        "sweep --report FILE",
        "tune --preset FILE",
        "tune --storage FILE --out tune",
        "tune --trials 1 --out FILE",
        "bench vision --frames 20 --real FILE",
        f"detect --rgb FILE {' '.join(CAMERA)}",
        f"detect --rgb color.png --depth FILE {' '.join(CAMERA)}",
        f"detect --rgb color.png --overlay FILE {' '.join(CAMERA)}",
        "detect --sequence FILE",
    ],
)
@pytest.mark.parametrize(
    "name", ["a" * 300, "a\0b", "\udcff", "file/x", "loop/x"], ids=["long", "zero", "bytes", "file", "loop"]
)
def test_names_that_no_system_takes(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    words: str,
    name: str,
) -> None:
    import cv2
    import numpy as np

    monkeypatch.chdir(tmp_path)
    cv2.imwrite("color.png", np.zeros((8, 8, 3), np.uint8))
    Path("file").touch()
    Path("loop").symlink_to("loop")
    refusal([name if word == "FILE" else word for word in words.split()], capfd)


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
