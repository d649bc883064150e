"""Load of ``ibvs-qp live``: headless clients that read everything; frames per second of each, late ticks, cores used.

Example: python benchmarks/live.py --clients 10
"""

from __future__ import annotations

import argparse
import asyncio
import os
import signal
import subprocess
import sys
import time

import psutil
import viser
import websockets


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


def main() -> None:
    """Fly, connect, read, and print."""
    parser = argparse.ArgumentParser(description="Load of ibvs-qp live")
    parser.add_argument("--clients", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--port", type=int, default=8765)
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
