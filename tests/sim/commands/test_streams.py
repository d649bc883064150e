"""Output that cannot be written ends in one line, and a closed one in silence; names of files that no system takes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sim.commands.cli import main

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
    assert main([name if word == "FILE" else word for word in words.split()]) == 2
    err = capfd.readouterr().err
    assert err.startswith("ibvs-qp: error: ") and err.count("\n") == 1 and len(err) < 2000
