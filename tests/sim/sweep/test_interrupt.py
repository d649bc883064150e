"""Ctrl-C on a sweep in two processes: finished flights stay, nothing is left running, and it goes on later."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

_PROGRAM = """
import sys
import sim.commands.experiment
import dataclasses
import sim.experiments.design as experiments
approach = experiments.experiment("approach")
short = dataclasses.replace(approach, fixed={"job.hold_s": 0.5})
experiments.experiment = lambda name: short
from sim.commands.cli import main
sys.exit(main())
"""


def start(out: Path) -> subprocess.Popen[bytes]:
    words = ["experiment", "approach", "--features", "geometric", "--json", "--jobs", "2", "--out", str(out)]
    program = [sys.executable, "-c", _PROGRAM, *words]
    return subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)


@pytest.mark.slow
@pytest.mark.parametrize("group", [False, True], ids=["parent alone", "whole group, as a terminal does"])
def test_ctrl_c_keeps_finished_flights(tmp_path, group):
    process = start(tmp_path)
    while len(list(tmp_path.glob("parts/part-*.parquet"))) < 2 and process.poll() is None:
        time.sleep(0.2)
    (os.killpg if group else os.kill)(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err.decode()
    content = json.loads(out)
    parts = list(tmp_path.glob("parts/part-*.parquet"))
    assert content["interrupted"] is True
    assert sum(cell["n"] for cell in content["cells"]) == len(parts) >= 2
    assert b"Traceback" not in err and b"go on with" in err
    assert _gone(process.pid)


def _gone(session: int) -> bool:
    """Whether every process of the session ends within a few seconds."""
    for _ in range(100):
        alive = subprocess.run(["ps", "-o", "pid=", "-g", str(session)], capture_output=True, text=True).stdout.split()
        if not alive:
            return True
        time.sleep(0.2)
    return False
