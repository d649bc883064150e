"""Load of ``ibvs-qp live``: frames per second of headless clients that read everything, late ticks, cores used.

With ``--chromium``, one page in Debian's Chromium that renders without a GPU: simulated over real time.

Example: python benchmarks/live.py --clients 10
"""

from __future__ import annotations

import argparse
import asyncio
import os
import re
import shutil
import signal
import subprocess
import sys
import time

import psutil
import viser
import websockets

#: Chromium without a GPU, and the size of its page [px].
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
PAGE_PX = {"width": 1366, "height": 768}


async def _read(port: int, seconds: float) -> float:
    """Windows of messages per second that one client receives."""
    protocol = websockets.Subprotocol(f"viser-v{viser.__version__}")
    count, loop = 0, asyncio.get_running_loop()
    async with websockets.connect(f"ws://127.0.0.1:{port}", subprotocols=[protocol], max_size=None) as socket:
        end = loop.time() + seconds
        while (left := end - loop.time()) > 0.0:
            try:
                await asyncio.wait_for(socket.recv(), left)
            except TimeoutError:
                break
            count += 1
    return count / seconds


def _used_s(parts: dict[str, psutil.Process]) -> dict[str, float]:
    """Processor time of each process so far [s]."""
    return {name: sum(process.cpu_times()[:2]) for name, process in parts.items()}


async def _all(port: int, clients: int, seconds: float) -> list[float]:
    if not clients:
        await asyncio.sleep(seconds)
    return await asyncio.gather(*(_read(port, seconds) for _ in range(clients)))


def _rate(port: int, seconds: float) -> float:
    """Simulated over real time while Chromium shows the page."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as library:
        browser = library.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        page = browser.new_page(viewport=PAGE_PX)  # type: ignore[arg-type]
        page.goto(f"http://127.0.0.1:{port}")
        page.wait_for_selector("canvas")

        def flown_s() -> float:
            page.wait_for_function("() => /\\d s x/.test(document.body.innerText)")
            found = re.search(r"(\d+\.\d\d) s x", page.inner_text("body"))
            assert found
            return float(found[1])

        first, began = flown_s(), time.monotonic()
        time.sleep(seconds)
        rate = (flown_s() - first) / (time.monotonic() - began)
        browser.close()
    return rate


def main() -> None:
    """Fly, connect, read, and print."""
    parser = argparse.ArgumentParser(description="Load of ibvs-qp live")
    parser.add_argument("--clients", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--port", type=int, default=8765)
    parser.add_argument("--chromium", action="store_true", help="one page in Chromium instead of the clients")
    given = parser.parse_args()
    command = [
        sys.executable,
        "-m",
        "sim.commands.cli",
        "live",
        "--no-open",
        "--port",
        str(given.port),
        "--press",
        "300",
    ]
    flight = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)  # nosec B603
    assert flight.stdout is not None
    try:
        print(flight.stdout.readline().strip())
        server, children = psutil.Process(flight.pid), psutil.Process(flight.pid).children()
        fly = next(each for each in children if "spawn_main" in " ".join(each.cmdline()))
        parts = {"flight": fly, "server": server, "clients": psutil.Process()}
        before, began = _used_s(parts), time.monotonic()
        rates = []
        if given.chromium:
            print(f"simulated over real time: {_rate(given.port, given.seconds):.2f}")
        else:
            rates = asyncio.run(_all(given.port, given.clients, given.seconds))
        took = time.monotonic() - began
        if rates:
            print(f"frames/s of {len(rates)} clients: {min(rates):.1f} to {max(rates):.1f}")
        cores = {name: (used - before[name]) / took for name, used in _used_s(parts).items()}
        load = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
        print("cores used:", ", ".join(f"{name} {each:.2f}" for name, each in cores.items()), f"({load})")
        flight.send_signal(signal.SIGTERM)
        print(flight.communicate(timeout=30)[0].strip())
    finally:
        flight.kill()


if __name__ == "__main__":
    main()
