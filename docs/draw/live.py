"""The animation of `ibvs-qp live`: its page in Chromium, tick by tick, while thrust limit and push are moved."""

from __future__ import annotations

import dataclasses
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Page, sync_playwright

from ibvs_qp.config.settings import dump_toml
from sim.world.scene import Scene

#: Size of the page [px], and longest wait for it [s]: rendering in software is slow.
PAGE_PX, PATIENCE_S = {"width": 1100, "height": 620}, 300.0
#: Chromium renders without a GPU.
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
#: Time of the touch with its ramp [s].
PRESSED_S = 6.0
#: Captions of sliders and their values, a picture every 0.1 s of flight; None moves nothing.
MOVES = [
    *[None] * 3,
    *[("thrust max", value) for value in (40.0, 30.0, 22.0, 17.0, 15.0, 14.0, 13.0)],
    *[None] * 5,
    *[("push [N]", value) for value in (8.0, 12.0, 16.0)],
    *[None] * 3,
]
#: Pictures of the charts at the end, and pictures per second [Hz].
CHARTS, RATE_HZ = 4, 4.0


def live() -> Iterator[np.ndarray]:
    """Pictures of the page, RGB."""
    scene = Scene()
    scene = dataclasses.replace(scene, start=dataclasses.replace(scene.start, distance_m=0.2))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "near.toml"
        file.write_text(dump_toml(scene))
        command = [sys.executable, "-m", "sim.commands.cli", "live", "--no-open", "--no-ghost", "--press", "60"]
        command += ["--scene", str(file), "--port", "8790"]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        try:
            assert server.stdout is not None
            found = re.search(r"http://\S+", server.stdout.readline())
            assert found, "the flight has not begun"
            with sync_playwright() as library:
                browser = library.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
                page = browser.new_page(viewport=PAGE_PX)  # type: ignore[arg-type]
                page.set_default_timeout(1e3 * PATIENCE_S)
                page.goto(found[0])
                yield from _pictures(page)
                browser.close()
        finally:
            server.terminate()
            server.wait(PATIENCE_S)


def _pictures(page: Page) -> Iterator[np.ndarray]:
    page.wait_for_selector("canvas")
    page.locator(".mantine-Notification-closeButton").click()  # that of rendering in software
    _until(page, PRESSED_S)
    _press(page, "Pause")
    page.wait_for_function("() => document.body.innerText.includes('paused')")
    for move in MOVES:
        if move is not None:
            _enter(page, *move)
        yield _next(page)
    page.get_by_role("tab", name="Charts", exact=True).click(force=True)
    for _ in range(CHARTS):
        yield _next(page)


def _next(page: Page) -> np.ndarray:
    now = _time_s(page)
    _press(page, "25 ticks")
    _until(page, now + 0.09)
    time.sleep(0.5)  # frames are sent 36 times a second, charts 3 times
    shot = cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR)
    assert shot is not None
    return shot[..., ::-1]


def _time_s(page: Page) -> float:
    found = re.search(r"(\d+\.\d\d) s", page.inner_text("body"))
    return float(found[1]) if found else -1.0


def _until(page: Page, time_s: float) -> None:
    end = time.monotonic() + PATIENCE_S
    while _time_s(page) < time_s:
        assert time.monotonic() < end, f"not at {time_s:.2f} s in time"
        time.sleep(0.1)


def _press(page: Page, label: str) -> None:
    page.get_by_role("button", name=label, exact=True).dispatch_event("click")


def _enter(page: Page, caption: str, value: float) -> None:
    box = page.get_by_text(caption, exact=False).first.locator("xpath=ancestor::*[.//input][1]//input").last
    box.focus()
    box.fill(str(value), force=True)
    page.keyboard.press("Enter")
