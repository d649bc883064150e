"""The server: hostile messages end their own connection with one line, a signal ends both processes, one writer."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
import time

import pytest

viser = pytest.importorskip("viser", reason="the extra live is not installed")
websockets = pytest.importorskip("websockets")
psutil = pytest.importorskip("psutil")

#: Messages that are no messages of viser.
HOSTILE = ["text", b"", b"\xff" * 64, b"\x81\xa4type\xa4Evil", b"\xdf\xff\xff\xff\xff", os.urandom(4096)]


def free_port() -> int:
    """A port that nothing listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def live():
    """A running server and its port."""
    port = free_port()
    command = [sys.executable, "-m", "sim.commands.cli", "live", "--no-open", "--port", str(port), "--press", "60"]
    flight = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert flight.stdout is not None
    assert f"http://127.0.0.1:{port}" in flight.stdout.readline()
    yield flight, port
    if flight.poll() is None:
        flight.kill()


async def connect(port: int):
    """A client that speaks viser's protocol."""
    protocol = websockets.Subprotocol(f"viser-v{viser.__version__}")
    return await websockets.connect(f"ws://127.0.0.1:{port}", subprotocols=[protocol], max_size=None)


async def attack(port: int) -> int:
    """Send every hostile message on a connection of its own; returns the frames of a client beside them."""
    frames = 0
    async with await connect(port) as watcher:
        for message in HOSTILE:
            async with await connect(port) as hostile:
                await hostile.send(message)
                await asyncio.sleep(0.2)
        end = time.monotonic() + 5.0
        while time.monotonic() < end:
            await asyncio.wait_for(watcher.recv(), 10.0)
            frames += 1
    return frames


def test_hostile_messages_are_one_line_each_and_a_signal_ends_both_processes(live):
    flight, port = live
    children = psutil.Process(flight.pid).children(recursive=True)
    assert any("spawn_main" in " ".join(child.cmdline()) for child in children)
    assert asyncio.run(attack(port)) > 10
    flight.send_signal(signal.SIGTERM)
    output, errors = flight.communicate(timeout=60)
    assert flight.returncode == 143
    assert "later than one tick" in output
    assert "Traceback" not in errors
    assert len([line for line in errors.splitlines() if "ignored" in line]) <= len(HOSTILE)
    _, alive = psutil.wait_procs(children, timeout=10)
    assert not alive


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--port", "80"], "--port"),
        (["--host", "no.such.host.invalid"], "cannot listen"),
        (["--press", "-1"], "hold_s"),
        (["--preset", "tarot_t960_paper"], "analytic"),
        (["--replay", "nothing.json"], "nothing.json"),
        (["--log", "nothing.mcap"], "nothing.mcap"),
    ],
)
def test_unusable_options_are_one_line(words, named):
    command = [sys.executable, "-m", "sim.commands.cli", "live", "--no-open", *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert named in done.stderr and len(done.stderr.splitlines()) == 1
