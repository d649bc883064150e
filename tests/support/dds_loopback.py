"""DDS on the loopback interface alone, without multicast; the bridge, its stand-in for PX4 and garbage as processes."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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
    return os.environ | {
        "CYCLONEDDS_URI": URI,
        "PYTHONPATH": paths,
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }


def domain(name: str) -> int:
    """A domain of a test's own, so that tests in parallel do not meet."""
    return 10 + (zlib.crc32(name.encode()) ^ os.getpid()) % 200


def require_dds() -> None:
    """Skip where DDS cannot start."""
    pytest.importorskip("cyclonedds", reason="needs the extra dds")
    code = "from ibvs_qp.interfaces.px4.dds import Participant; Participant(231)"
    done = subprocess.run([sys.executable, "-c", code], env=environment(), capture_output=True, text=True, timeout=60)
    if done.returncode != 0:
        pytest.skip(f"DDS cannot start on the loopback interface: {done.stderr.strip().splitlines()[-1]}")


def first_in_line() -> list[str]:
    """Prefix of a command that runs before others, where that is allowed; docs/px4.md asks for it."""
    prefix = ["chrt", "-f", "20"]
    allowed = shutil.which("chrt") and subprocess.run([*prefix, "true"], capture_output=True).returncode == 0
    return prefix if allowed else []


@dataclass(kw_only=True)
class Flown:
    """What the three processes said."""

    seen: dict[str, Any]
    lines: list[str]
    garbage: dict[str, int]

    @property
    def ignored(self) -> dict[str, int]:
        """Messages that the bridge left out, where it printed JSON."""
        return json.loads(self.lines[-1])["ignored"]


def fly(
    folder: Path, number: int, *, garbage: tuple[int, float] | None = None, as_json: bool = False, **plan: Any
) -> Flown:
    """Run the bridge before the stand-in until that ends.

    Args:
        folder: For the bridge's settings.
        number: DDS domain.
        garbage: Packets, and their rate [Hz].
        as_json: Whether the bridge prints JSON at its end; lines of its states otherwise.
        plan: Of `px4_stand_in.Plan`.
    """
    (folder / "bridge.toml").write_text(f"domain_id = {number}\n")
    here, first = ROOT / "tests" / "support", first_in_line()
    lasting = str(plan["duration_s"] + plan.get("wait_s", 90.0) + 20.0)
    bridge = [sys.executable, "-m", "sim.commands.cli", "bridge", "--config", str(folder / "bridge.toml")]
    bridge += ["--duration", lasting, *(["--json"] if as_json else [])]
    stand_in = [sys.executable, str(here / "px4_stand_in.py"), json.dumps(plan | {"domain": number})]
    noise = [sys.executable, str(here / "dds_garbage.py"), str(number), *map(str, garbage or ())]
    with _process([*first, *bridge]) as flying, _process([*first, *stand_in]) as px4, contextlib.ExitStack() as more:
        rubbish = more.enter_context(_process(noise)) if garbage else None
        seen = json.loads(px4.communicate(timeout=float(lasting))[0])
        sent = json.loads(rubbish.communicate(timeout=60)[0]) if rubbish else {}
        flying.terminate()  # as Ctrl-C
        lines = flying.communicate(timeout=30)[0].splitlines()
    return Flown(seen=seen, lines=lines, garbage=sent)


def fly_in_lock_step(number: int, packets: int, **plan: Any) -> dict[str, Any]:
    """Report of bridge and stand-in in one process, with so many packets of garbage a tick from another."""
    script = ROOT / "tests" / "support" / "px4_lock_step.py"
    command = [sys.executable, str(script), str(packets), json.dumps(plan | {"domain": number})]
    with _process(command) as process:
        return json.loads(process.communicate()[0])


@contextlib.contextmanager
def _process(command: list[str]) -> Iterator[subprocess.Popen[str]]:
    """A process that ends with the test; Cyclone DDS tells of every broken packet on standard error."""
    streams: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    with subprocess.Popen(command, env=environment(), **streams) as process:
        try:
            yield process
        finally:
            process.kill()
