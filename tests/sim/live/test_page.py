"""The page in a real browser without a display: it draws, every control acts, a saved session repeats bit-identically.

Needs playwright for Python and Debian's chromium (``.ci/run`` installs it); software rendering is enough.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ibvs_qp.estimation.turned_camera import straightened
from sim.evaluate.explanation import flown_config
from sim.flight.flight_log import load_run
from sim.live.explaining import WhatIf

pytest.importorskip("viser", reason="the extra live is not installed")
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium")
pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium: apt-get install chromium"),
    pytest.mark.slow,
]

FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
#: Messages of the page's libraries that are no errors of the page.
HARMLESS = re.compile(r"deprecated|GPU stall|favicon", re.IGNORECASE)
#: Longest wait for the page on a loaded machine [s].
PATIENCE_S = 400.0


def wait_for(what, condition) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.2)


class Page:
    """The page under test."""

    def __init__(self, page) -> None:
        self.page = page

    @property
    def text(self) -> str:
        """Text of the page."""
        return self.page.inner_text("body")

    @property
    def time_s(self) -> float:
        """Time in the status line."""
        found = re.search(r"(\d+\.\d\d) s", self.text)
        return float(found[1]) if found else -1.0

    def press(self, label: str) -> None:
        """Press a button or a tab; software rendering is too slow for playwright's wait for a steady page."""
        self.page.get_by_role("button", name=label, exact=True).dispatch_event("click")

    def tab(self, label: str) -> None:
        """Open a tab."""
        self.page.get_by_role("tab", name=label, exact=True).click(force=True)

    def enter(self, label: str, value: float) -> None:
        """Type a number into the box of a slider."""
        caption = self.page.get_by_text(label, exact=False).first
        box = caption.locator("xpath=ancestor::*[.//input][1]//input").last.element_handle()
        box.evaluate("(each) => each.focus()")
        box.fill(str(value), force=True)  # changes the caption, so the box is not looked up again
        self.page.keyboard.press("Enter")


@pytest.fixture
def live(serve, tmp_path):
    """The page of a flight, and the errors in its console."""
    _, port = serve("--press", "60", "--no-ghost", "--out", str(tmp_path))
    errors: list[str] = []
    with playwright.sync_playwright() as library:
        browser = library.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        try:
            page = browser.new_page(viewport={"width": 900, "height": 500})
            page.set_default_timeout(1e3 * PATIENCE_S)
            page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
            page.on("pageerror", lambda error: errors.append(str(error)))
            page.goto(f"http://127.0.0.1:{port}")
            page.wait_for_selector("canvas")
            yield Page(page), errors
        finally:
            browser.close()


def test_the_page_draws_and_every_control_acts(live, tmp_path):
    page, errors = live
    wait_for("a flight", lambda: page.time_s > 0.3)
    shot = page.page.screenshot(timeout=1e3 * PATIENCE_S)
    colors = set(zip(*[iter(_pixels(shot))] * 3, strict=False))
    assert len(colors) > 100  # not blank

    page.press("Pause")
    wait_for("pause", lambda: "paused" in page.text)
    before = page.time_s
    page.press("25 ticks")
    wait_for("25 ticks", lambda: abs(page.time_s - before - 0.1) < 0.011)

    page.press("Run")
    wait_for("run", lambda: page.time_s > before + 0.5)
    page.enter("push = 0.5", -1.0)  # decades: the weight of the push row is 0.1
    wait_for("a changed weight", lambda: "weights.push 0.1" in page.text)
    changed = page.time_s
    wait_for("flight with it", lambda: page.time_s > changed + 0.5)  # more than the rewind below

    page.tab("Disturb")
    page.press("Rotor lost")
    wait_for("a lost rotor", lambda: "derated to 0 %" in page.text)

    page.press("Pause")
    wait_for("pause", lambda: "paused" in page.text)
    page.enter("back", 0.3)
    then = page.time_s
    page.press("Rewind and fork")
    wait_for("rewind", lambda: "back here" in page.text and page.time_s < then)

    page.tab("Why")
    page.press("Explain the tick")
    wait_for("an explanation", lambda: "whole wrench" in page.text or "Unallocated" in page.text)

    page.tab("Save")
    page.press("Save preset, session and log")
    wait_for("a session", lambda: list(tmp_path.glob("*/session.json")))
    session = next(tmp_path.glob("*/session.json"))
    wait_for("a log", lambda: (session.parent / "run" / "log.npz").exists())
    saved = json.loads(session.read_text())
    assert 0.004 * saved["ticks"] == pytest.approx(page.time_s, abs=0.0051)  # shown with two decimals
    pushes = _weights(session.parent / "run", "weights.push")
    change = next(each for each in saved["changes"] if "weights.push" in each["values"])
    assert set(pushes[: change["tick"]]) == {0.5} and set(pushes[change["tick"] :]) == {0.1}  # acts at the next tick
    command = [sys.executable, "-m", "sim.commands.cli", "live", "--replay", str(session)]
    assert "bit-identical" in subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert "0.1" in (session.parent / "preset.toml").read_text()
    assert [text for text in errors if not HARMLESS.search(text)] == []


def _weights(run: Path, name: str) -> list[float]:
    """A setting in the program of every tick of a log."""
    trace = load_run(run)["qp"]
    what_if = WhatIf(straightened(flown_config(trace).controller))
    return [round(what_if.settings(point)[name], 6) for point in trace.arrays["program"]]


def _pixels(picture: bytes) -> bytes:
    """Every hundredth pixel of a PNG, RGB."""
    import cv2
    import numpy as np

    return cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)[::10, ::10].tobytes()
