"""Notebook 02 as a reader uses it: served by marimo, with controls moved while it flies."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import websockets

from sim.notebook.common import SHORT_VARIABLE
from sim.notebook.render import NOTEBOOKS

#: Longest wait for the notebook to be served, or to be idle [s]; steps of a slider that is dragged, and between them.
PATIENCE_S, STEPS, STEP_S = 400.0, 10, 0.05
_ELEMENT = re.compile(r"object-id='([^']+)'[^>]*><marimo-(?:slider|button|text)[^>]*?data-label='([^']*)'")


@pytest.fixture
def served(tmp_path: Path) -> Iterator[tuple[str, Path]]:
    """Address of the notebook, in the short form, and the folder in which it runs."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    notebook = NOTEBOOKS / "02_constraint_tuning.py"
    words = [str(notebook), "--headless", "--no-token", "--no-skew-protection", "--host", "127.0.0.1", "-p", str(port)]
    process = subprocess.Popen(
        [sys.executable, "-m", "marimo", "-q", "run", *words],
        cwd=tmp_path,
        env=os.environ | {SHORT_VARIABLE: "1", "PYTHONPATH": str(NOTEBOOKS.parent)},
        start_new_session=True,
    )
    try:
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{port}/health").close()
                break
            except OSError:
                time.sleep(0.3)
        yield f"127.0.0.1:{port}", tmp_path
    finally:
        os.killpg(process.pid, signal.SIGTERM)
        process.wait(20.0)


class Reader:
    """A browser's connection: what the page shows, and what its reader does."""

    def __init__(self, address: str, socket: Any) -> None:
        self._address, self._socket = address, socket
        self.elements: dict[str, str] = {}
        self.changes: list[str] = []  # texts below the figure, in order
        self.notes: list[str] = []  # outputs with the line below the load button

    async def until_idle(self) -> None:
        """Read the page until every cell has run and nothing follows."""
        quiet = PATIENCE_S
        while True:
            try:
                message = json.loads(await asyncio.wait_for(self._socket.recv(), quiet))
            except TimeoutError:
                assert quiet < PATIENCE_S, "the notebook does not end its run"
                return
            data = message.get("data") or {}
            text = str((data.get("output") or {}).get("data") or "")
            for name, label in _ELEMENT.findall(text):
                words = re.sub(r"<[^>]*>|&quot;", "", label.replace("&#92;u003c", "<").replace("&#92;u003e", ">"))
                self.elements[words] = name
            if "begun with" in text or "Not loaded" in text:
                self.notes.append(re.sub(r"<[^>]*>", " ", text))
            if "Changed" in text and "<strong>" in text:
                self.changes.append(re.sub(r"<[^>]*>", " ", text))
            quiet = 2.0 if message.get("op") == "completed-run" else PATIENCE_S if quiet == PATIENCE_S else 20.0

    def send(self, label: str, value: object) -> None:
        """Move a control."""
        body = {"objectIds": [self.elements[label]], "values": [value]}
        head = {"Content-Type": "application/json", "Marimo-Session-Id": "s_reader"}
        address = f"http://{self._address}/api/kernel/set_ui_element_value"
        urllib.request.urlopen(urllib.request.Request(address, json.dumps(body).encode(), head)).close()


async def drag(address: str, folder: Path) -> None:
    async with websockets.connect(f"ws://{address}/ws?session_id=s_reader", max_size=None) as connection:
        reader = Reader(address, connection)
        await reader.until_idle()
        assert reader.changes and "nothing" in reader.changes[-1]
        seen = len(reader.changes)
        for label in ("push [N]", "friction [-]"):
            for step in range(1, STEPS + 1):
                reader.send(label, step)  # position of the slider
                await asyncio.sleep(STEP_S)
        await reader.until_idle()
        flown = reader.changes[seen:]
        assert 1 <= len(flown) <= 4, f"{2 * STEPS} steps flew {len(flown)} times"
        assert "push [N]: 5 → 6" in flown[-1] and "friction [-]: 0.3 → 0.5" in flown[-1]
        reader.send("reset all", 1)
        await reader.until_idle()
        assert "nothing" in reader.changes[-1]
        reader.send("preset (name or file)", "octorotor_qp")
        reader.send("load", 1)
        await reader.until_idle()
        assert any("begun with" in text and "octorotor_qp" in text for text in reader.notes)
        reader.send("push [N]", 10)
        await reader.until_idle()
        moved, *_ = re.findall(r"push \[N\]: \S+ → \S+", reader.changes[-1])
        for preset, reason in (("tarot_t960_paper", "analytic law"), ("octorotor_pq", "does not exist")):
            seen = len(reader.changes)
            reader.send("preset (name or file)", preset)
            reader.send("load", 2)
            await reader.until_idle()
            assert "Not loaded" in reader.notes[-1] and reason in reader.notes[-1]
            assert len(reader.changes) == seen, "a refused preset flies nothing"
        reader.send("friction [-]", 12)
        await reader.until_idle()
        assert moved in reader.changes[-1] and "friction [-]" in reader.changes[-1], "a refused preset resets a control"
        assert not list(folder.iterdir()), "nothing is written before it is asked for"


@pytest.mark.slow
def test_a_dragged_slider_flies_the_last_value_and_no_other_control_is_lost(served: tuple[str, Path]) -> None:
    asyncio.run(drag(*served))
