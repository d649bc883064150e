"""``ibvs-qp export-c``: the printed command, without the library itself (tests/ibvs_qp/interfaces/c_library)."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from sim.commands.cli import main


def test_the_printed_command_is_one_that_a_shell_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in (
        "ibvs_qp.interfaces.c_library.library.write_library",
        "ibvs_qp.interfaces.c_library.recorded.write_recorded",
    ):
        monkeypatch.setattr(name, lambda *_: None)
    monkeypatch.setattr("sim.bench.ticks.press_flight", lambda *_: [])
    folder = tmp_path / "my lib's; controller"
    assert main(["export-c", str(folder)]) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if "make" in line)
    assert shlex.split(line.partition(": ")[2]) == ["make", "-C", str(folder), "test"]
