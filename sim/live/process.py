"""The process of the flight: steps a session at the rate of the clock, executes commands, and sends frames."""

from __future__ import annotations

import contextlib
import dataclasses
import gc
import math
import signal
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from select import select
from typing import Any

import numpy as np

from ibvs_qp.checked_law import CheckedLaw
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError, IbvsQpError, out_of_range
from ibvs_qp.model.inputs import setting_values
from sim.live.camera_picture import packed_picture
from sim.live.ghost import Ghost
from sim.live.rows import KEPT_S, LiveLoop
from sim.live.session import CEILING, Session
from sim.live.session_file import Start, changes_text
from sim.storage.atomic import write_text

#: Frames per second of the clock [Hz]; of coverage and pictures among them [Hz].
FRAME_HZ, PICTURE_HZ = 36.0, 6.0
#: The same without a new tick [Hz]: a page renders for 250 ms after every message, and leaves the processor no time.
IDLE_HZ = 2.0
#: Rates of simulated over real time [-].
SLOWEST, FASTEST = 0.1, 10.0
#: Ticks are flown up to this much ahead of the clock [s]: a tick with a snapshot takes 30 ms, and delays none after it.
AHEAD_S = 0.04
#: A flight that is behind the clock by more than this drops the lost time [s].
BEHIND_S = 0.25
#: Ticks between rows for the charts [-].
ROW_TICKS = 10
#: Resolution of the paint in frames [px/m].
PAINT_PX_M = 100.0


class Pace:
    """Which tick is due, by the clock.

    Attributes:
        late: Ticks that began more than a tick late, of `flown`.
    """

    def __init__(self, tick_s: float) -> None:
        self._tick_s, self.rate = tick_s, 1.0
        self.late = self.flown = 0
        self.anchor(0)

    def anchor(self, ticks: int) -> None:
        """The given tick is due now."""
        self._begin_s, self._first = time.monotonic(), ticks

    def wait_s(self, ticks: int) -> float:
        """Time until a tick may begin, at most `AHEAD_S` before it is due [s]; drops lost time."""
        due_s = self._begin_s + (ticks - self._first) * self._tick_s / self.rate
        left_s = due_s - time.monotonic()
        if left_s < -BEHIND_S:
            self.anchor(ticks)
        return left_s - AHEAD_S

    def count(self, late_s: float) -> None:
        """Count a tick that begins so late."""
        self.flown += 1
        self.late += late_s > self._tick_s / self.rate


class FlightProcess:
    """Executes commands and flies: `run` returns when the connection closes.

    Commands are tuples of a name and arguments, see the methods ``do_*``. Replies: ("frame", table), ("changed",
    table), ("refused", text), ("rewound", tick, settings), ("point", tick, inputs), ("found", ticks ago, tick, inputs),
    ("saved", text).

    Args:
        connection: To the server.
        start: Beginning of the session.
        ghost: The analytic law beside it.
    """

    def __init__(self, connection: Connection, start: Start, ghost: Ghost | None = None) -> None:
        self._connection, self._ghost = connection, ghost
        self._running, self._over = True, ""
        self.session = session = Session(start, ghost)
        assert isinstance(session.qp.loop, LiveLoop)
        self._loop, self._recorder = session.qp.loop, session.qp.loop.recorder
        self._pace = Pace(self._loop.pilot.config.controller.tick_s)
        self._sent = self._sent_events = self._framed = 0
        self._next_frame_s = self._next_picture_s = self._speed_s = 0.0
        self._speed_tick, self._speed, self._paint_shown = 0, 0.0, False

    def run(self) -> None:
        """Fly until the server is gone."""
        self._pace.anchor(self.session.ticks)
        with contextlib.suppress(EOFError, BrokenPipeError, ConnectionError):
            while True:
                self._tick_when_due()
        self.session.close()

    def _tick_when_due(self) -> None:
        session, pace = self.session, self._pace
        now, wait_s = time.monotonic(), 1.0 / FRAME_HZ
        if self._running and session.going:
            wait_s = pace.wait_s(session.ticks)
            if wait_s <= 0.0:
                pace.count(-wait_s - AHEAD_S)
                session.step()
        elif not session.going and self._running:
            self._running, self._over = False, self._loop.reason or self._loop.pilot.painter.reason or "finished"
        if now >= self._next_frame_s and select([], [self._connection], [], 0.0)[1]:
            rate_hz, self._framed = FRAME_HZ if session.ticks != self._framed else IDLE_HZ, session.ticks
            self._next_frame_s = max(self._next_frame_s + 1.0 / rate_hz, now)
            self._connection.send(("frame", self._frame(now)))
        if self._connection.poll(min(max(wait_s, 0.0), max(self._next_frame_s - now, 0.0))):
            self._execute(*self._connection.recv())

    def _execute(self, name: str, *values: Any) -> None:
        try:
            getattr(self, f"do_{name}")(*values)
        except IbvsQpError as error:
            self._connection.send(("refused", str(error), self._settings()))

    def do_change(self, kind: str, values: dict[str, Any], sent_s: float) -> None:
        """Change settings, task or world before the next tick; counts the ticks since the message was received."""
        began = self._recorder.rows(self._recorder.ticks - 100, self._recorder.ticks)[:, 1]
        change = self.session.change(kind, values)
        waited = int((began > sent_s).sum())
        self._connection.send(("changed", dataclasses.asdict(change), waited))

    def do_run(self, running: bool) -> None:
        """Fly or pause."""
        if running and self._over:
            raise ConfigError(f"the flight is over ({self._over}); rewind and fork")
        self._running = running
        if not running:
            gc.collect()
        self._pace.anchor(self.session.ticks)

    def do_step(self, ticks: int) -> None:
        """Fly some ticks while paused."""
        self._running, self._next_frame_s = False, 0.0
        for _ in range(min(ticks, round(1.0 / self._loop.pilot.config.controller.tick_s))):
            if self.session.going:
                self.session.step()

    def do_rate(self, rate: float) -> None:
        """Simulated over real time."""
        if not math.isfinite(rate):
            raise out_of_range("speed", rate, "", "a finite number is needed")
        self._pace.rate = min(max(rate, SLOWEST), FASTEST)
        self._pace.anchor(self.session.ticks)

    def do_rewind(self, tick: int) -> None:
        """Pause at an earlier tick of the last minute."""
        self._running, self._over = False, ""
        self.session.rewind(tick)
        self._sent, self._sent_events = self.session.ticks, self._recorder.noted
        self._paint_shown = False
        self._connection.send(("rewound", self.session.ticks, self._settings()))

    def do_point(self, tick: int) -> None:
        """Send the inputs of the program of a tick."""
        tick = min(max(tick, 0), self._recorder.ticks - 1)
        if len(self._recorder.rows(tick, tick + 1)):
            self._connection.send(("point", tick, self._recorder.point(tick)))

    def do_limited(self) -> None:
        """Pause, and send the newest tick with an active thrust limit."""
        if (tick := self._recorder.last_limited()) is None:
            raise ConfigError(f"no thrust limit was active in the last {KEPT_S:g} s")
        self.do_run(False)
        self._connection.send(("found", self.session.ticks - tick, tick, self._recorder.point(tick)))

    def do_save(self, folder: str) -> None:
        """Write the session and the preset with its changes."""
        path, pilot = Path(folder), self._loop.pilot
        self.session.file().write(path / "session.json")
        solver = dataclasses.replace(pilot.config.controller.solver, backend="python", name=self.session.qp.solver)
        flown = dataclasses.replace(self._law_config(), solver=solver)
        config = dataclasses.replace(pilot.config, controller=flown)
        write_text(path / "preset.toml", changes_text(config, pilot.painter.config, self._settings()[CEILING]))
        self._connection.send(("saved", str(path), len(self.session.changes)))

    def _settings(self) -> dict[str, Any]:
        pilot = self._loop.pilot
        task = {name: getattr(pilot.painter.config, name) for name in ("push_n", "speed_m_s")}
        task |= {CEILING: float(self._loop.world.plant.thrust_limits[1].max())}
        return dict(setting_values(self._law_config())) | task | {"solver.name": self.session.qp.solver}

    def _law_config(self) -> ControllerConfig:
        law = self._loop.pilot.controller
        assert isinstance(law, CheckedLaw)
        return law.config

    def _frame(self, now: float) -> dict[str, Any]:
        session, recorder, loop = self.session, self._recorder, self._loop
        if now - self._speed_s >= 1.0:
            ticks = session.ticks - self._speed_tick
            self._speed = max(ticks, 0) * loop.pilot.config.controller.tick_s / max(now - self._speed_s, 1e-9)
            self._speed_s, self._speed_tick = now, session.ticks
        end = max(session.ticks // ROW_TICKS * ROW_TICKS, self._sent)
        every, price = recorder.rows(self._sent, end), recorder.places["price"]
        rows, self._sent = every[::ROW_TICKS].copy(), end
        if len(rows):  # a limit that is active in one tick only is seen
            rows[:, price] = np.maximum.reduceat(every[:, price], np.arange(0, len(every), ROW_TICKS))
        last = recorder.rows(session.ticks - 1, session.ticks)
        new, self._sent_events = recorder.events_since(self._sent_events), recorder.noted
        table: dict[str, Any] = {
            "ticks": session.ticks,
            "first": session.first,
            "running": self._running,
            "over": self._over,
            "speed": self._speed if self._running else 0.0,
            "late": self._pace.late / max(self._pace.flown, 1),
            "flown": self._pace.flown,
            "rows": rows,
            "row": last[0] if len(last) else None,
            "ghost": self._ghost.pose if self._ghost is not None else None,
            "limits": loop.world.plant.thrust_limits,
            "reduction": loop.pilot.push_report.reduction,
            "events": [(event.t, event.kind, event.text) for event in new],
        }
        if now >= self._next_picture_s:
            self._next_picture_s = now + 1.0 / PICTURE_HZ
            table |= {"paint": self._paint(), "picture": packed_picture(self._loop)}
        return table

    def _paint(self) -> np.ndarray | None:
        """Painted fraction of the board, uint8; None where nothing is new."""
        if self._paint_shown and not self._loop.world.plant.contact_normal_force:
            return None
        self._paint_shown = True
        return self._loop.world.canvas.thumbnail(PAINT_PX_M)


def fly(connection: Connection, start: Start, ghost: tuple[Connection, Sequence[float]] | None) -> None:
    """Main function of the process; Ctrl-C is for the server, whose end ends this."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        process = FlightProcess(connection, start, None if ghost is None else Ghost(*ghost))
    except IbvsQpError as error:
        connection.send(("failed", str(error)))
        return
    connection.send(("ready", process._recorder.places, process._recorder.limits, process._settings()))
    gc.disable()  # a tick leaves no cycles of references, and a collection among the snapshots takes 80 ms
    process.run()
