"""Signs of work in a file: a line every few seconds, whatever the work reports, and none for a quiet console."""

from __future__ import annotations

import io
from collections.abc import Callable
from queue import Queue

import pytest
from rich.console import Console

import sim.flight.working
from sim.flight.working import flight_progress, working, write
from sim.sweep.progress import sweep_progress
from sim.world.scene import Scene

#: Most time without a line [s], also from one kind of work to the next.
WANTED_S = 10.0


class Work:
    """Work of some length that reports nothing, in time of its own [s]."""

    def __init__(self, length_s: float) -> None:
        self.now, self.left = 0.0, length_s

    def over(self, at_most_s: float) -> bool:
        """Let time pass."""
        passed = min(at_most_s, self.left)
        self.now, self.left = self.now + passed, self.left - passed
        return self.left <= 0.0


class Times(io.StringIO):
    """A file that notes when a line is written."""

    def __init__(self, work: Work) -> None:
        super().__init__()
        self.work, self.times = work, []

    def write(self, text: str) -> int:
        self.times += [self.work.now] * text.count("\n")
        return super().write(text)


def test_silent_work_writes_a_line_every_few_seconds() -> None:
    work = Work(60.0)
    file = Times(work)
    write(Console(file=file), lambda: "Drawing", work.over, lambda: work.now)
    gaps = [b - a for a, b in zip([0.0, *file.times], [*file.times, 60.0], strict=True)]
    assert max(gaps[0] + max(gaps), *gaps) <= WANTED_S, "the first gap of the next kind of work follows the last one"
    assert file.getvalue().splitlines()[:2] == ["Drawing (3 s)", "Drawing (9 s)"]


@pytest.mark.parametrize(("length_s", "quiet"), [(2.0, False), (60.0, True)])
def test_short_work_and_a_quiet_console_write_nothing(length_s: float, quiet: bool) -> None:
    work, file = Work(length_s), io.StringIO()
    write(Console(file=file, quiet=quiet), lambda: "Drawing", work.over, lambda: work.now)
    assert file.getvalue() == ""


def test_a_closed_output_does_not_end_the_work() -> None:
    work, file = Work(60.0), io.StringIO()
    console = Console(file=file)
    file.close()
    write(console, lambda: "Drawing", work.over, lambda: work.now)
    assert work.left == 0.0


@pytest.fixture
def state(monkeypatch: pytest.MonkeyPatch) -> Callable[[], str]:
    """What a line would say now."""
    found: Queue[Callable[[], str]] = Queue()

    def now() -> str:
        found.put(asked := found.get())  # waits for the thread
        return asked()

    monkeypatch.setattr(sim.flight.working, "write", lambda _, state, over: found.put(state) or over(None))
    return now


def shown_by(file: io.StringIO) -> Console:
    return Console(file=file, force_terminal=False)


def test_every_law_is_in_the_line_of_a_flight(state: Callable[[], str]) -> None:
    file = io.StringIO()
    with flight_progress(shown_by(file), Scene(), ("qp", "paper")) as update:
        assert state() == "QP law: starting; analytic law: starting"
        update("qp", 12.34, "row 1", 3.21)
        assert "QP law:  12.3 s  row 1" in state() and "analytic law: starting" in state()
    assert file.getvalue() == ""


def test_finished_runs_are_in_the_line_of_a_sweep(state: Callable[[], str]) -> None:
    with sweep_progress(shown_by(io.StringIO()), "friction") as update:
        assert state() == "friction: starting"
        update(5, 12, 2, 0.3)
        assert state() == "friction: 3/10 (2 on disk already)"


def test_the_line_of_other_work_follows_it(state: Callable[[], str]) -> None:
    with working(shown_by(io.StringIO()), "Measuring ...") as update:
        assert state() == "Measuring ..."
        update("Measuring rivals ...")
        assert state() == "Measuring rivals ..."


def test_a_terminal_gets_no_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sim.flight.working, "lines", None)
    monkeypatch.setattr("sim.flight.working.lines", None)
    monkeypatch.setattr("sim.sweep.progress.lines", None)
    console = Console(file=io.StringIO(), force_terminal=True)
    with working(console, "Drawing"), sweep_progress(console, "x") as update:
        update(1, 2, 0)
