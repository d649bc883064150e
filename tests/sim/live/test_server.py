"""The server: hostile messages end their own connection with one line, a signal ends both processes, one writer."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
import time

import pytest

viser = pytest.importorskip("viser", reason="the extra live is not installed")
websockets = pytest.importorskip("websockets")
psutil = pytest.importorskip("psutil")

#: Messages that are no messages of viser.
HOSTILE = ["text", b"", b"\xff" * 64, b"\x81\xa4type\xa4Evil", b"\xdf\xff\xff\xff\xff", bytes(range(256)) * 16]


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


def test_hostile_messages_are_one_line_each_and_a_signal_ends_both_processes(serve):
    flight, port = serve("--press", "60")
    children = psutil.Process(flight.pid).children(recursive=True)
    assert any("spawn_main" in " ".join(child.cmdline()) for child in children)
    assert asyncio.run(attack(port)) > 10
    flight.send_signal(signal.SIGTERM)
    output, errors = flight.communicate(timeout=60)
    assert flight.returncode == 143
    assert "later than one tick" in output
    *lines, last = errors.splitlines()
    assert last == "ibvs-qp: interrupted"
    assert all(line.startswith("ibvs-qp live: ignored: ") for line in lines), errors
    assert len(lines) == len(HOSTILE), errors
    _, alive = psutil.wait_procs(children, timeout=10)
    assert not alive


def test_a_flight_that_dies_is_exit_code_1_and_one_line(serve):
    flight, _ = serve("--press", "60", "--no-ghost")
    children = psutil.Process(flight.pid).children(recursive=True)
    next(child for child in children if "spawn_main" in " ".join(child.cmdline())).kill()
    _, errors = flight.communicate(timeout=60)
    assert flight.returncode == 1
    assert errors.splitlines() == ["ibvs-qp: the process of the flight has ended"]


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--port", "80"], "--port"),
        (["--host", "no.such.host.invalid"], "cannot listen"),
        (["--press", "-1"], "--press"),
        (["--preset", "tarot_t960_paper"], "analytic"),
        (["--replay", "nothing.json"], "nothing.json"),
        (["--log", "nothing.mcap"], "no such file"),
        (["--json"], "--json"),
    ],
)
def test_unusable_options_are_one_line(words, named, tmp_path):
    command = [sys.executable, "-m", "sim.commands.cli", "live", "--no-open", *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=tmp_path)
    assert done.returncode == 2
    assert named in done.stderr and len(done.stderr.splitlines()) == 1
