"""A running ``ibvs-qp live``."""

from __future__ import annotations

import re
import select
import socket
import subprocess
import sys

import pytest

#: Longest wait for its address, and for its end, on a loaded machine [s].
READY_S, END_S = 400.0, 60.0


@pytest.fixture
def free_port():
    """A port that nothing listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def serve(free_port):
    """Start it with some options; returns the process and its port. It is ended after the test."""
    started = []

    def start(*words: str) -> tuple[subprocess.Popen[str], int]:
        command = [sys.executable, "-m", "sim.commands.cli", "live", "--no-open", "--port", str(free_port), *words]
        flight = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        started.append(flight)
        assert flight.stdout is not None
        assert select.select([flight.stdout], [], [], READY_S)[0], "no address in time"
        assert re.search(rf"http://127.0.0.1:{free_port}\b", flight.stdout.readline())
        return flight, free_port

    try:
        yield start
    finally:
        for flight in started:
            if flight.poll() is None:
                flight.terminate()
                try:
                    flight.communicate(timeout=END_S)
                except subprocess.TimeoutExpired:
                    flight.kill()
                    flight.communicate()
