"""DDS on the loopback interface alone, without multicast, and whether it starts here."""

from __future__ import annotations

import os
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: Cyclone DDS finds its peers on 127.0.0.1 by trying the ports of ten participants.
URI = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>10</MaxAutoParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
    "</Domain></CycloneDDS>"
)


def environment() -> dict[str, str]:
    """Environment of a process that uses DDS."""
    paths = os.pathsep.join((str(ROOT), str(ROOT / "tests" / "support")))
    return os.environ | {"CYCLONEDDS_URI": URI, "PYTHONPATH": paths, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def domain(name: str) -> int:
    """A domain of a test's own, so that tests in parallel do not meet."""
    return 10 + (zlib.crc32(name.encode()) ^ os.getpid()) % 200


def require_dds() -> None:
    """Skip where DDS cannot start."""
    pytest.importorskip("cyclonedds", reason="needs the extra dds")
    code = "from ibvs_qp.bridge.dds import Participant; Participant(231)"
    done = subprocess.run([sys.executable, "-c", code], env=environment(), capture_output=True, text=True, timeout=60)
    if done.returncode != 0:
        pytest.skip(f"DDS cannot start on the loopback interface: {done.stderr.strip().splitlines()[-1]}")
