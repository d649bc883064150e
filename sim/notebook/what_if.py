"""Notebook 02: a recorded tick solved again with another weight or bound, and the setting flown in the browser."""

from __future__ import annotations

import html
import math
import socket
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.qp.explain import Explanation
from sim.evaluate.explanation import flown_config
from sim.evaluate.window import phase_window
from sim.flight.trace import Trace
from sim.live.explaining import CEILING, WhatIf
from sim.notebook.common import BLUE, RED
from sim.notebook.tuning import save_setting
from sim.notebook.wall_flights import Setting

#: Widths of names, bars and numbers, and height of a row [px]; most limits with bars [-].
_NAME_PX, _BAR_PX, _NUMBER_PX, _ROW_PX, _MOST = 110, 190, 110, 22, 6
#: A thrust this near to the ceiling is at it [N].
_NEAR_N = 0.01
#: Longest wait for the end of a live flight [s].
_END_S = 10.0
#: The command; it ends when its standard input does, however the notebook ends.
_LIVE = """
import os, signal, sys, threading
from sim.commands.cli import main
def watch():
    sys.stdin.read()
    os.kill(os.getpid(), signal.SIGTERM)
threading.Thread(target=watch, daemon=True).start()
sys.exit(main(["live", *sys.argv[1:]]))
"""


class RecordedTicks:
    """Ticks of a flight under the QP law, solved again.

    Attributes:
        names: Settings that can be scaled.
        end_s: Time of the last tick [s].
        hold_s: Time of the last tick that presses at one place [s]; half of the flight where it never presses.

    Args:
        trace: The flight.
    """

    def __init__(self, trace: Trace) -> None:
        self._points, self._t = trace.arrays["program"], trace.t
        self._what_if = WhatIf(straightened(flown_config(trace).controller))
        self.names, self.end_s = self._what_if.names, float(trace.t[-1])
        held = phase_window(trace, "press")[1]
        self.hold_s = float(held) if math.isfinite(held) else 0.5 * self.end_s

    def show(self, time_s: float, name: str, factor: float) -> tuple[str, str]:
        """Bars of thrusts and prices (SVG) and the explanation (markdown) of the tick at a time.

        Args:
            time_s: Time of the tick.
            name: The setting of `names` that is changed.
            factor: Factor on its value.
        """
        tick = int(np.argmin(np.abs(self._t - time_s)))
        point, head = self._points[tick], f"**Tick {tick}, t = {self._t[tick]:.3f} s**"
        try:
            value, flown, now = self._what_if.scaled(point, name, factor)
        except ConfigError as error:
            return "", f"{head}\n\n**Refused:** {error}"
        ceiling = self._what_if.ceiling(point)
        words = f"{head}, **{name} = {value:.4g}** (flown: {value / factor:.4g})"
        text = self._what_if.markdown(point, now, flown)
        drawn = self._bars(flown, now, value if name == CEILING else ceiling, ceiling)
        return drawn, f"{words}\n\n{text}"

    def _bars(self, flown: Explanation | None, now: Explanation | None, limit: float, full: float) -> str:
        if flown is None or now is None:
            return ""
        thrusts = list(zip(self._what_if.rotors, flown.thrusts, now.thrusts, strict=True))
        before, after = ({limit.name: limit.price for limit in each.active_limits} for each in (flown, now))
        limits = [(row, before.get(row, 0.0), after.get(row, 0.0)) for row in before | after]
        limits = sorted(limits, key=lambda each: -max(each[1:]))[:_MOST]
        return (
            bars("thrust [N]: now, grey: flown, line: upper limit", thrusts, limit - _NEAR_N, full)
            + bars("price of a limit: now, grey: flown" if limits else "no limit is active, no price", limits)
        )  # fmt: skip


def bars(title: str, rows: Sequence[tuple[str, float, float]], limit: float = math.inf, full: float = 0.0) -> str:
    """Two bars for each name, before and now, as SVG: a figure of matplotlib takes longer than the solution.

    Args:
        title: Above them.
        rows: Name, value before, value now.
        limit: Values from here on are red; a line is drawn there, if it is inside.
        full: Least value at the right end.
    """
    full = max([full, *(value for row in rows for value in row[1:]), 1e-9])
    width, height = _NAME_PX + _BAR_PX + _NUMBER_PX, _ROW_PX * (len(rows) + 1)
    parts = [f'<text x="0" y="15" font-weight="bold">{html.escape(title)}</text>']
    for index, (name, before, now) in enumerate(rows, 1):
        top = index * _ROW_PX
        parts.append(f'<text x="0" y="{top + 15}">{html.escape(name)}</text>')
        for value, color, y, thick in ((before, "#bbbbbb", 3, 16), (now, RED if now >= limit else BLUE, 7, 8)):
            long = _BAR_PX * max(value, 0.0) / full
            parts.append(f'<rect x="{_NAME_PX}" y="{top + y}" width="{long:.1f}" height="{thick}" fill="{color}"/>')
        change = f"{now:.3g} ({now - before:+.2g})" if abs(now - before) > 1e-3 * full else f"{now:.3g}"
        parts.append(f'<text x="{_NAME_PX + _BAR_PX + 6}" y="{top + 15}">{change}</text>')
    if math.isfinite(limit):
        x = _NAME_PX + _BAR_PX * limit / full
        parts.append(
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{_ROW_PX}" y2="{height}" stroke="{RED}" stroke-width="1.5"/>'
        )
    return f'<svg width="{width}" height="{height}" font-size="12" fill="#333333">{"".join(parts)}</svg>'


class LiveFlight:
    """``ibvs-qp live`` in a process of its own, with a setting of the notebook; it ends with the notebook."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def start(self, setting: Setting) -> str:
        """End the last one, start another, and wait for its address; returns markdown.

        Raises:
            ConfigError: When the setting cannot be saved, or does not fly.
        """
        self.end()
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        folder = Path(tempfile.mkdtemp(prefix="ibvs-qp-live-"))
        preset, scene = save_setting(setting, folder / "notebook.toml")
        command = [sys.executable, "-c", _LIVE, "--no-open", "--port", str(port)]
        command += ["--preset", str(preset), "--scene", str(scene), "--seed", str(setting.seed), "--out", str(folder)]
        pipe = subprocess.PIPE
        self._process = process = subprocess.Popen(  # nosec B603
            command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True
        )
        assert process.stdout is not None
        line = process.stdout.readline().strip()
        if f":{port}" not in line:
            raise ConfigError(line)
        address = f"http://127.0.0.1:{port}"
        return f"`ibvs-qp live` flies the setting of the sidebar: **[{address}]({address})**. It saves to `{folder}`."

    def end(self) -> None:
        """End it."""
        if self._process is not None:
            try:
                self._process.communicate(timeout=_END_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.communicate()
            self._process = None
