"""The thread of the log: a killed process, a slow writer, a full disk, and a loop that none of them disturbs."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from recorded_flights import flown, logged

import ibvs_qp.interfaces.log.writer
from ibvs_qp import HybridController
from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.interfaces.log import Recorder, read_log, replay
from ibvs_qp.interfaces.log.writer import LogWriter

ROOT = Path(__file__).parents[4]
#: Steps a controller at 250 Hz and prints the ticks so far.
FLY = """
import sys
import numpy as np
from ibvs_qp import HybridController, Measurement, Reference
from ibvs_qp.pilot.runner import run
from ibvs_qp.interfaces.log import Recorder

recorder, ticks = Recorder(sys.argv[1], HybridController()), 0

def tick(_):
    global ticks
    ticks += 1
    stamp = 4_000_000 * ticks
    recorder.step(
        Measurement(
            stamp_ns=stamp, attitude=np.array([1.0, 0.0, 0.0, 0.0]), angular_velocity=np.zeros(3),
            specific_force=np.array([0.0, 0.0, -9.81]), contact_wrench=np.zeros(6), wrench_stamp_ns=stamp,
        ),
        Reference(standoff=0.3),
    )
    if ticks % 10 == 0:
        print(ticks, recorder.dropped, flush=True)
    return True

run(tick)
"""


class Waiting:
    """A call that lasts until `go` is set."""

    def __init__(self, writer: LogWriter) -> None:
        self.started, self.go = threading.Event(), threading.Event()
        assert writer.offer(self) and self.started.wait(10.0)

    def __call__(self, log: Any) -> None:
        self.started.set()
        self.go.wait(60.0)


def test_a_killed_process_leaves_nearly_all_ticks(tmp_path: Path) -> None:
    """At most 0.2 s are lost, and 97 % of 10 s and more are kept."""
    file = tmp_path / "a.mcap"
    process = subprocess.Popen([sys.executable, "-c", FLY, str(file)], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    assert process.stdout is not None
    for line in process.stdout:
        flown_ticks, dropped = map(int, line.split())
        assert dropped == 0
        if flown_ticks >= 2500:
            break
    process.send_signal(signal.SIGKILL)
    rest = process.stdout.read().split("\n")
    flown_ticks = max([flown_ticks, *(int(line.split()[0]) for line in rest if len(line.split()) == 2)])
    process.wait()
    result = replay(read_log(file))
    kept = result.ticks / flown_ticks
    print(f"{result.ticks} of {flown_ticks} ticks kept ({kept:.2%})")
    assert result.same and not result.complete and result.missing == 0
    assert kept > 0.97 and flown_ticks - result.ticks <= 60  # 0.2 s, and the ticks that were not printed


def test_a_full_queue_drops_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ibvs_qp.interfaces.log.writer, "ROOM", 50)
    subject, inputs = flown("rotor_loss", "controller")
    given = list(inputs)
    with Recorder(tmp_path / "a.mcap", subject) as recorder:
        recorder.step(*given[0])
        recorder.writer.wait_for_room()
        waiting = Waiting(recorder.writer)
        for tick in range(1, 101):
            recorder.step(*given[tick])
        assert recorder.dropped == 50
        waiting.go.set()
        while recorder.writer._queue:
            pass
        for tick in range(101, 121):
            recorder.step(*given[tick])
            recorder.writer.wait_for_room()
    result = replay(read_log(tmp_path / "a.mcap"))
    assert result.same and result.ticks == 51 and result.missing == 50 and result.complete
    messages = logged(tmp_path / "a.mcap")
    notes = [content.message for topic, content in messages if topic == "/log"]
    assert "50 entries are missing from here: the queue of the log was full" in notes
    assert [content.dropped for topic, content in messages if topic == "/control"][-1] == 50


def test_ticks_missing_at_the_end_are_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ibvs_qp.interfaces.log.writer, "ROOM", 20)
    subject, inputs = flown("rotor_loss", "controller")
    with Recorder(tmp_path / "a.mcap", subject) as recorder:
        waiting = Waiting(recorder.writer)
        for _, given in zip(range(30), inputs, strict=False):
            recorder.step(*given)
        waiting.go.set()
    result = replay(read_log(tmp_path / "a.mcap"))
    assert result.same and result.ticks == 20 and result.missing == 10


def test_a_call_that_fails_ends_no_log(tmp_path: Path) -> None:
    def fail(log: Any) -> None:
        raise ZeroDivisionError("no such value")

    writer = LogWriter(tmp_path / "a.mcap", {}, dict)
    assert writer.offer(fail) and writer.offer(LogWriter.note, 2, "x", "after")
    writer.close()
    texts = [content.message for _, content in logged(tmp_path / "a.mcap")]
    assert texts == ["not written: ZeroDivisionError: no such value", "after"] and not writer.problem


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_ends_the_log_and_not_the_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    subject, inputs = flown("rotor_loss", "controller")
    with Recorder(tmp_path / "a.mcap", subject) as recorder:
        monkeypatch.setattr(recorder.writer._writer, "_Writer__stream", open("/dev/full", "wb"))
        for _, given in zip(range(200), inputs, strict=False):
            assert recorder.step(*given).thrusts.all()
        recorder.close()
    assert "cannot write the log" in recorder.problem and "No space left" in recorder.problem
    assert recorder.writer._stream.closed


def test_a_file_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(IbvsQpError, match=r"cannot write the log .*: Is a directory"):
        Recorder(tmp_path, HybridController())
    (tmp_path / "file").touch()
    with pytest.raises(IbvsQpError, match="cannot write the log"):
        Recorder(tmp_path / "file" / "a.mcap", HybridController())


@pytest.mark.parametrize("odd", [(), ("x",), (None, None), (1, 2, 3, 4), (object(), [])])
def test_inputs_of_any_type_do_not_raise(tmp_path: Path, odd: tuple[Any, ...]) -> None:
    """Except for the error of the controller at a wrong number of arguments."""
    for kind in ("controller", "assured", "pilot"):
        subject, _ = flown("rotor_loss", kind)
        with Recorder(tmp_path / f"{kind}.mcap", subject) as recorder:
            try:
                alone = subject.step(*odd)
            except TypeError:
                with pytest.raises(TypeError):
                    recorder.step(*odd)
                continue
            subject.reset()
            recorder.step(*odd)
        assert alone is not None and replay(read_log(tmp_path / f"{kind}.mcap")).same


def test_a_recorder_that_is_never_closed_ends_its_file(tmp_path: Path) -> None:
    words = [sys.executable, "-c", FLY.replace("return True", "return ticks < 50"), str(tmp_path / "a.mcap")]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    result = replay(read_log(tmp_path / "a.mcap"))
    assert result.complete and result.ticks == 50 and result.same


def test_without_the_extra_one_line_names_it() -> None:
    code = (
        "import sys\n"
        "sys.modules.update(dict.fromkeys(('mcap', 'mcap_protobuf', 'foxglove_schemas_protobuf')))\n"
        "from ibvs_qp.config.errors import ConfigError\n"
        "try:\n"
        "    import ibvs_qp.interfaces.log\n"
        "except ConfigError as error:\n"
        "    print(error)\n"
        "from sim.commands.cli import main\n"
        "assert main(['paint', '--log', 'mcap', '--out', 'none']) == 2 == main(['replay', 'x.mcap'])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "MCAP logs need the extra log: pip install" in done.stdout
    assert done.stderr.count("ibvs-qp: error: MCAP logs need the extra log") == 2 and done.stderr.count("\n") == 2


def test_a_writer_that_does_not_finish_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ibvs_qp.interfaces.log.writer, "CLOSE_S", 0.05)
    writer = LogWriter(tmp_path / "a.mcap", {}, dict)
    waiting = Waiting(writer)
    writer.close()
    assert "was not finished within 0.05 s" in writer.problem
    waiting.go.set()
