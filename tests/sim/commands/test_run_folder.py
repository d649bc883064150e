"""A run folder: one process at a time, nothing of an earlier run lost, rows on the disk while the flight goes on."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from made_up_flights import draw_one_figure, fake_fly

import sim.flight.side_by_side
from ibvs_qp.config.errors import IbvsQpError
from sim.commands.cli import main
from sim.flight.flight_log import load_run
from sim.flight.journal import NOTES, Header
from sim.flight.trace import KILLED
from sim.report.rundir import RunFolder
from sim.storage.folder import locked_folder

pytestmark = pytest.mark.timeout(300)
PROGRAM = "import sys; from sim.commands.cli import main; sys.exit(main())"
#: A flight that no machine has finished before the signal.
LONG = "[paint]\nrows = 8\n"


@pytest.fixture
def flown(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setattr(sim.flight.side_by_side, "fly", fake_fly)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0}, raising=False)
    monkeypatch.chdir(tmp_path)
    draw_one_figure(monkeypatch)
    return tmp_path


def one_line(capfd: pytest.CaptureFixture[str]) -> str:
    out, err = capfd.readouterr()
    assert out == "" and err.count("\n") == 1 and err.startswith("ibvs-qp: error: ")
    return err


def content(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def test_a_folder_with_files_is_refused_and_stays_as_it_is(flown: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (flown / "run").mkdir()
    (flown / "run" / "notes.txt").write_text("mine")
    assert main(["paint", "--json", "--no-video", "--out", "run"]) == 2
    assert "run is not empty" in (line := one_line(capfd)) and "--overwrite" in line
    assert content(flown / "run") == {"notes.txt": b"mine"}


@pytest.mark.parametrize("words", [["experiment", "approach", "--quick"], ["tune"], ["sweep", "spec.toml"]])
def test_a_resumable_command_refuses_the_run_of_a_flight(
    flown: Path, capfd: pytest.CaptureFixture[str], words: list[str]
) -> None:
    (flown / "spec.toml").write_text("")
    (flown / "run").mkdir()
    (flown / "run" / "log.npz").write_text("")
    assert main([*words, "--json", "--out", "run"]) == 2
    assert "run of a flight" in one_line(capfd)


def test_a_held_folder_is_refused_and_free_again_when_its_process_dies(
    flown: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    hold = "import sys, time; from pathlib import Path; from sim.storage.folder import locked_folder\n"
    hold += "with locked_folder(Path('run')): print('held', flush=True); time.sleep(100)"
    with subprocess.Popen([sys.executable, "-c", hold], stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == b"held\n"
        for words in (["paint", "--overwrite"], ["experiment", "approach", "--quick"]):
            assert main([*words, "--json", "--out", "run"]) == 2
            assert "in use" in one_line(capfd)
        holder.send_signal(signal.SIGKILL)
    assert main(["paint", "--json", "--no-video", "--law", "qp", "--out", "run"]) == 0


def test_a_folder_that_stays_empty_is_removed(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), locked_folder(tmp_path / "a" / "b"):
        raise ZeroDivisionError
    assert not (tmp_path / "a" / "b").exists()
    with RunFolder.open(tmp_path / "c") as folder:
        (folder.path / "file").write_text("")
    assert (tmp_path / "c" / "file").exists()


def test_a_file_system_without_locks_is_used_all_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr("fcntl.flock", refuse)
    with RunFolder.open(tmp_path / "run") as folder:
        assert folder.path.exists()


def test_two_runs_of_one_second_have_folders_of_their_own(flown: Path) -> None:
    with RunFolder.open(None) as one, RunFolder.open(None) as two:
        assert one.path != two.path


def start(out: Path, *words: str, **options: object) -> subprocess.Popen[bytes]:
    (out.parent / "long.toml").write_text(LONG)
    flight = ["paint", "--features", "geometric", "--json", "--no-video", "--scene", str(out.parent / "long.toml")]
    command = [sys.executable, "-c", PROGRAM, *flight, "--out", str(out), *words]
    pipes: dict[str, object] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "start_new_session": True}
    return subprocess.Popen(command, **(pipes | options))  # type: ignore[call-overload]


def wait_for_rows(out: Path, laws: int, least: int = 200_000) -> None:
    """Until every law has so many bytes of rows on the disk."""
    for _ in range(1200):
        rows = list(out.glob("partial-*/*.rows"))
        if len(rows) == laws and all(file.stat().st_size > least for file in rows):
            return
        time.sleep(0.1)
    raise AssertionError("no rows")


@pytest.mark.parametrize("law", ["qp", "both"])
def test_after_kill_9_the_rows_are_there(tmp_path: Path, law: str, capfd: pytest.CaptureFixture[str]) -> None:
    process = start(tmp_path / "run", "--law", law)
    wait_for_rows(tmp_path / "run", 2 if law == "both" else 1, 1_500_000)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate(timeout=60)
    sizes = {file.stem: file.stat().st_size for file in (tmp_path / "run").glob("partial-*/*.rows")}
    traces = load_run(tmp_path / "run")
    assert set(traces) == set(sizes)
    for trace in traces.values():
        assert len(trace.t) > 500 and np.allclose(np.diff(trace.t), 0.004)
        assert trace.reason == KILLED and not trace.claimed and trace.events[-1].text == KILLED
        assert np.isfinite(trace.thrusts).all() and trace.scene.paint.rows == 8
    assert main(["explain", str(tmp_path / "run"), "--at", "1", "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["tasks"]


@pytest.mark.slow
def test_rows_on_the_disk_are_the_rows_flown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed before any tick of a flight, at most a chunk of 25 rows is missing."""
    from closed_loop_rigs import short_scene

    from sim.flight.closed_loop import fly
    from sim.flight.options import FlightOptions

    ticks = 0

    def die(*_: object) -> None:
        nonlocal ticks
        ticks += 125  # `PROGRESS_TICKS`
        if ticks >= 1500:
            raise ZeroDivisionError

    options = FlightOptions(features="geometric", video=False, journal=str(tmp_path / "partial-1"))
    with pytest.raises(ZeroDivisionError):
        fly(short_scene(0.3, rows=1), options, die)
    left = load_run(tmp_path)["qp"]
    assert len(left.t) == ticks
    whole = fly(short_scene(0.3, rows=1), options)
    for name, array in left.arrays.items():
        if name not in ("step_us", "vision_ms", "limit_price", "active") and array.ndim and len(array) >= ticks:
            np.testing.assert_array_equal(array, whole.arrays[name][: len(array)], err_msg=name)
    for index, name in enumerate(left.limits):
        np.testing.assert_array_equal(left.active[:, index], whole.active[:ticks, whole.limits.index(name)])
    file = next(tmp_path.glob("partial-1/qp.rows"))
    file.write_bytes(file.read_bytes()[:-100])  # the process died while it wrote
    assert len(load_run(tmp_path)["qp"].t) == len(whole.t) - 1


@pytest.mark.slow
@pytest.mark.parametrize("group", [pytest.param(False, id="parent alone"), pytest.param(True, id="whole group")])
def test_sigterm_writes_the_partial_run(tmp_path: Path, group: bool) -> None:
    process = start(tmp_path / "run")
    wait_for_rows(tmp_path / "run", 2)
    (os.killpg if group else os.kill)(process.pid, signal.SIGTERM)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 143, err.decode()
    summary = json.loads(out)
    assert summary["interrupted"] is True and set(summary["laws"]) == {"qp", "paper"}
    assert b"Traceback" not in err and b"interrupted; the partial run is in" in err
    traces = load_run(tmp_path / "run")
    assert all(trace.reason == "interrupted" and len(trace.t) > 100 for trace in traces.values())
    assert not list((tmp_path / "run").glob("partial-*"))


@pytest.mark.slow
def test_sigterm_ends_a_background_job_with_ctrl_c_ignored(tmp_path: Path) -> None:
    """A shell without job control starts jobs in that way."""
    process = start(tmp_path / "run", "--law", "qp", preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    wait_for_rows(tmp_path / "run", 1)
    process.terminate()
    _, err = process.communicate(timeout=120)
    assert process.returncode == 143, err.decode()


@pytest.mark.slow
def test_two_runs_into_one_folder(tmp_path: Path) -> None:
    first = start(tmp_path / "run", "--law", "qp")
    wait_for_rows(tmp_path / "run", 1, 1)
    second = start(tmp_path / "run", "--law", "qp", "--overwrite")
    _, err = second.communicate(timeout=120)
    assert second.returncode == 2 and err.count(b"\n") == 1 and b"in use" in err
    first.send_signal(signal.SIGINT)
    first.communicate(timeout=120)
    assert first.returncode == 130 and load_run(tmp_path / "run")["qp"].seed == 0


def test_a_killed_parent_leaves_no_process_behind(tmp_path: Path) -> None:
    process = start(tmp_path / "run", stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_for_rows(tmp_path / "run", 2)
    process.kill()
    process.wait()
    for _ in range(300):
        alive = subprocess.run(["ps", "-o", "pid=", "-g", str(process.pid)], capture_output=True, text=True).stdout
        if not alive.strip():
            break
        time.sleep(0.2)
    assert not alive.strip()
    assert set(load_run(tmp_path / "run")) == {"qp", "paper"}


def test_overwrite_keeps_the_old_run_until_the_new_one_is_flown(flown: Path, capfd, monkeypatch) -> None:
    words = ["paint", "--json", "--no-video", "--law", "qp", "--out", "run"]
    assert main([*words, "--seed", "1"]) == 0
    before = content(flown / "run")

    def fail(*_: object, **__: object) -> None:
        raise IbvsQpError("no flight")

    monkeypatch.setattr(sim.flight.side_by_side, "fly", fail)
    assert main([*words, "--seed", "2", "--overwrite"]) == 2
    assert content(flown / "run") == before
    monkeypatch.setattr(sim.flight.side_by_side, "fly", fake_fly)
    assert main([*words, "--seed", "2", "--overwrite"]) == 0
    assert load_run("run")["qp"].seed == 2


def limit_files(size: int) -> None:
    """Files of this process beyond a size fail like those on a full disk."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))


@contextmanager
def full_disk(monkeypatch: pytest.MonkeyPatch, size: int) -> Iterator[None]:
    """`limit_files` for a while, without bytecode: CPython 3.11 keeps bytecode that a limit has cut short."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    with monkeypatch.context() as context:
        context.setattr(sys, "dont_write_bytecode", True)
        limit_files(size)
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.slow
def test_a_full_disk_in_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")  # as in `full_disk`
    process = start(tmp_path / "run", "--law", "qp", preexec_fn=lambda: limit_files(1_000_000))
    out, err = process.communicate(timeout=200)
    assert process.returncode == 2 and out == b"" and err.count(b"\n") == 1, err.decode()
    assert b"cannot write the log" in err and b"partial-" in err
    rows = next((tmp_path / "run").glob("partial-*/qp.rows"))
    with open(rows.with_suffix(NOTES), encoding="utf-8") as notes:
        row_bytes = Header(**json.loads(next(notes))).row.itemsize
    trace = load_run(tmp_path / "run")["qp"]
    assert len(trace.t) * row_bytes > 0.95 * rows.stat().st_size > 0.9 * 1_000_000


@pytest.mark.parametrize("size", [1000, 100_000])
def test_a_full_disk_at_the_end(
    flown: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    words = ["paint", "--json", "--no-video", "--law", "qp", "--out", "run"]
    assert main([*words, "--seed", "1"]) == 0
    before = content(flown / "run")
    capfd.readouterr()
    with full_disk(monkeypatch, size):
        assert main([*words, "--seed", "2", "--overwrite"]) == 2
    assert "cannot write run/log.npz: File too large" in one_line(capfd)
    assert content(flown / "run") == before


@pytest.mark.parametrize("words", [["experiment", "approach", "--quick", "--jobs", "1"], ["sweep", "spec.toml"]])
def test_a_full_disk_ends_other_commands_in_one_line(
    flown: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, words: list[str]
) -> None:
    from synthetic_trace import synthetic_trace

    import sim.sweep.flying

    monkeypatch.setattr(sim.sweep.flying, "fly", lambda scene, options, **_: synthetic_trace(scene=scene))
    (flown / "spec.toml").write_text("")
    with full_disk(monkeypatch, 1000):
        assert main([*words, "--json", "--out", "run"]) == 2
    assert "File too large" in one_line(capfd)


@pytest.mark.parametrize("error", [PermissionError(13, "Permission denied"), OSError(30, "Read-only file system")])
def test_a_folder_that_cannot_be_written(flown, capfd, monkeypatch: pytest.MonkeyPatch, error: OSError) -> None:
    def refuse(self: Path, *_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(Path, "mkdir", refuse)
    for words in (["paint"], ["experiment", "approach", "--quick"], ["sweep", "spec.toml"], ["tune"]):
        (flown / "spec.toml").write_text("")
        assert main([*words, "--out", "locked", "--json"]) == 2
        line = one_line(capfd)
        assert "locked" in line and error.strerror in line and "--out" in line


def test_a_full_output(tmp_path: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full on this system")
    (tmp_path / "spec.toml").write_text("")
    with open("/dev/full", "wb") as full:
        command = [sys.executable, "-c", PROGRAM, "sweep", "spec.toml", "--plan"]
        done = subprocess.run(command, cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "No space left" in done.stderr
