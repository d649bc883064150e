"""The server: viser's page, the process of the flight, and their messages."""

from __future__ import annotations

import functools
import itertools
import multiprocessing
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import viser

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.pilot.painting.strategy import PHASES
from sim.flight.options import pilot_config
from sim.live.charts import CHARTS_HZ, Charts
from sim.live.explaining import WhatIf
from sim.live.ghost import SHARED, follow
from sim.live.panel import Panel
from sim.live.process import fly
from sim.live.rows import STATES
from sim.live.scene import LiveScene
from sim.live.session_file import Start
from sim.live.site import address, open_browser, stop

#: Status lines per second [Hz]; longest wait for the first frame, and for the process to end [s].
_STATUS_HZ, _READY_S, _END_S = 5.0, 120.0, 5.0


class FlightEnded(RuntimeError):
    """The process of the flight has ended by itself."""


class LiveServer:
    """A flight in the browser.

    Args:
        start: Beginning of the session.
        server: viser's server.
        out: Folder of saved files.
        ghost: Whether a second vehicle flies under the analytic law.
    """

    def __init__(self, start: Start, server: viser.ViserServer, out: Path, ghost: bool = True) -> None:
        self._start, self._server, self._out = start, server, out
        context = multiprocessing.get_context("spawn")
        self._connection, *others = context.Pipe()
        beside, processes = None, []
        if ghost:
            shared, pair = context.RawArray("d", SHARED), context.Pipe()
            beside = pair[0], shared
            processes.append(context.Process(target=follow, args=(pair[1], start, shared), name="ghost", daemon=True))
            others += pair
        self._flight = context.Process(target=fly, args=(others[0], start, beside), name="flight", daemon=True)
        for process in (self._flight, *processes):
            process.start()
        for other in others:  # each process ends with the one that it serves
            other.close()
        self._waiting = server.gui.add_markdown("Preparing the flight ...")
        self._sending, self._closed = threading.Lock(), threading.Event()
        self._log: subprocess.Popen[bytes] | None = None
        self._status_s = self._charts_s = 0.0
        self._folders = itertools.count(1)
        self._last: dict[str, Any] | None = None

    def run(self, browser: bool, ready: Callable[[str], None]) -> None:
        """Serve until Ctrl-C, or until the flight's process ends.

        Args:
            browser: Whether to open the page.
            ready: Called with the address once the flight is ready.

        Raises:
            ConfigError: When the flight cannot begin.
            FlightEnded: When its process ends.
        """
        try:
            if not self._connection.poll(_READY_S):
                raise ConfigError("the flight is not ready in time")
            kind, *values = self._receive()
            if kind == "failed":
                raise ConfigError(str(values[0]))
            self._build(*values)
            ready(address(self._server))
            if browser:
                open_browser(self._server)
            while True:
                self._read()
        finally:
            self.close()
            if (last := self._last) is not None:
                late = f"{100.0 * last['late']:.2f} % of {last['flown']} ticks later than one tick"
                print(f"ibvs-qp live: flown to {last['ticks'] * self._tick_s:.2f} s; {late}", flush=True)

    def close(self) -> None:
        """End both processes."""
        if not self._closed.is_set():
            self._closed.set()
            self._connection.close()
            self._flight.join(_END_S)
            if self._flight.is_alive():
                self._flight.kill()
            if self._log is not None:
                self._log.terminate()
                try:
                    self._log.wait(_END_S)
                except subprocess.TimeoutExpired:
                    self._log.kill()
                    self._log.wait()
            stop(self._server)

    def _receive(self) -> tuple[Any, ...]:
        try:
            return self._connection.recv()
        except (EOFError, ConnectionError):
            raise FlightEnded("the process of the flight has ended") from None

    def _build(self, places: dict[str, slice], limits: tuple[str, ...], settings: dict[str, Any]) -> None:
        start = self._start
        config = pilot_config(start.scene, start.options("qp"), start.config("qp"))
        self._places, self._tick_s = places, config.controller.tick_s
        server, what_if = self._server, WhatIf(straightened(config.controller))
        self._waiting.remove()
        self._scene = LiveScene(server, start.scene, config, start.seed)
        view = functools.partial(setattr, self._scene)
        self._panel = Panel(server, self._send, settings, what_if, self._save, view)
        with self._panel.charts_tab:
            self._charts = Charts(server.gui, places, limits, what_if.rotors, path=start.press is None)

    def _send(self, *command: Any) -> None:
        with self._sending:
            if not self._closed.is_set():
                self._connection.send(command)

    def _read(self) -> None:
        """Handle the messages of the flight; of several frames only the last one is shown."""
        shown, rows, events, paint = None, [], [], None
        messages = [self._receive()]
        while self._connection.poll():
            messages.append(self._receive())
        for kind, *values in messages:
            if kind == "frame":
                shown = values[0]
                rows.append(shown["rows"])
                events += shown["events"]
                paint = shown["paint"] if shown.get("paint") is not None else paint
            else:
                if rows:  # those before a rewind belong to the trace before
                    self._charts.add(np.concatenate(rows))
                    rows = []
                getattr(self, f"_on_{kind}")(*values)
        if rows:
            self._charts.add(np.concatenate(rows))
        if shown is not None:
            self._show(shown | {"events": events, "paint": paint})

    def _show(self, frame: dict[str, Any]) -> None:
        now, row = time.monotonic(), frame["row"]
        self._last = frame
        self._scene.show(frame, self._places)
        if row is not None and (now >= self._status_s or frame["events"]):
            self._status_s = now + 1.0 / _STATUS_HZ
            phase, state = (int(row[self._places[name]][0]) for name in ("phase", "state"))
            self._panel.frame(frame, PHASES[phase], STATES[state])
        if now >= self._charts_s:
            self._charts_s = now + 1.0 / CHARTS_HZ
            self._charts.show()
            self._check_log()

    def _on_changed(self, change: dict[str, Any], waited: int) -> None:
        self._panel.changed(change, waited)

    def _on_refused(self, text: str, settings: dict[str, Any]) -> None:
        self._panel.refused(text, settings)

    def _on_rewound(self, tick: int, settings: dict[str, Any]) -> None:
        self._charts.rewind(tick * self._tick_s)
        self._panel.rewound(tick * self._tick_s, settings)

    def _on_point(self, tick: int, point: np.ndarray) -> None:
        self._panel.why.explain(tick, tick * self._tick_s, point)

    def _on_found(self, back: int, tick: int, point: np.ndarray) -> None:
        self._panel.point_back(back * self._tick_s)
        self._on_point(tick, point)

    def _on_saved(self, folder: str, changes: int) -> None:
        if self._log is not None:  # two clicks before the first reply
            self._panel.refuse(f"{folder} has no log: that of the save before is being flown")
            return
        command = [sys.executable, "-m", "sim.commands.cli", "live", "--replay", f"{folder}/session.json", "--out"]
        command.append(f"{folder}/run")
        self._log = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # nosec B603
        count = f"{changes} change{'s' * (changes != 1)}"
        self._panel.saved.content = (
            f"`{folder}`: session.json ({count}) and preset.toml. The log is being flown again from it ..."
        )

    def _check_log(self) -> None:
        if self._log is not None and (code := self._log.poll()) is not None:
            self._log = None
            text = "The log is in `run/log.npz`, bit-identical." if code == 0 else "The log could not be written."
            self._panel.saved.content = f"{self._panel.saved.content.rsplit(' The log', 1)[0]} {text}"

    def _save(self) -> None:
        if self._log is not None:
            self._panel.refuse("the log of the save before is being flown; save after it")
            return
        stamp = time.strftime("%Y-%m-%dT%H-%M-%S", time.gmtime())
        self._send("save", str(self._out / f"{stamp}-{next(self._folders)}"))
