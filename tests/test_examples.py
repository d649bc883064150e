"""Every example runs, without the simulator, and does what its text says."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
#: Runs a script where the simulator and everything that draws cannot be imported.
ALONE = """
import importlib.abc, runpy, sys

class Missing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("sim", "mujoco", "matplotlib", "cv2", "tests"):
            raise ImportError(f"{name} is not installed here")

sys.meta_path.insert(0, Missing())
runpy.run_path(sys.argv[1], run_name="__main__")
"""


def run(script: Path) -> str:
    command = [sys.executable, "-c", ALONE, str(script)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def printed() -> dict[str, str]:
    assert {"plain_python", "my_task"} <= {script.stem for script in EXAMPLES}
    return {script.stem: run(script) for script in EXAMPLES}


def test_every_example_runs_and_prints(printed: dict[str, str]) -> None:
    assert all(text.strip() for text in printed.values())


def test_plain_python_presses_and_slides(printed: dict[str, str]) -> None:
    rows = re.findall(
        r"([\d.]+) s +(\w+) +push +(-?[\d.]+) N +height error +([-+][\d.]+) mm +slid +([-+][\d.]+) m +(\w+)",
        printed["plain_python"],
    )
    assert len(rows) == 12
    pressed = [row for row in rows if float(row[0]) >= 4.0]
    assert all(row[1] == "contact" and row[5] == "solved" for row in pressed)
    assert np.abs([float(row[2]) - 5.0 for row in pressed]).max() <= 0.5
    assert np.abs([float(row[3]) for row in pressed]).max() <= 3.0
    assert float(rows[-1][4]) == pytest.approx(-0.35, abs=0.03)


def test_plain_python_stays_short() -> None:
    """The point of the example is that a vehicle of one's own takes a page."""
    text = (ROOT / "examples" / "plain_python.py").read_text(encoding="utf-8")
    assert len(text[text.index("class Vehicle") : text.index("def main")].splitlines()) <= 75


def test_my_task_moves_what_it_says_and_nothing_else(printed: dict[str, str]) -> None:
    shipped, quiet, limited = (
        [float(number) for number in re.findall(r"-?\d+\.\d+", line)] for line in printed["my_task"].splitlines()
    )
    # Front rotors (two), push, climb, price.
    assert max(quiet[:2]) < 5.0 < 9.0 < min(shipped[:2])
    assert quiet[2:4] == pytest.approx(shipped[2:4], abs=0.02)
    assert limited[3] == pytest.approx(0.5, abs=0.2) and limited[2] == pytest.approx(5.0, abs=0.02)
    assert limited[4] > 10.0 and shipped[4] == quiet[4] == 0.0
    assert printed["my_task"].count(" solved") == 3


def test_added_rows_are_named_and_switch_off_by_weight() -> None:
    example = runpy.run_path(str(ROOT / "examples" / "my_task.py"))
    engine = example["program"]([example["QuietRotors"](("r0", "r7"), thrust_n=4.0)], [example["ClimbLimit"](0.5)])
    names = [row.name for row in engine.template.task_rows]
    assert names[-2:] == ["quiet_r0", "quiet_r7"] and engine.template.row_names[-1] == "climb"
    assert engine.template.variable_names[-1] == "slack_climb"
    shipped = example["program"]([], []).solve()
    engine.data.parameters["quiet"][1] = 0.0
    engine.data.parameters["velocity_down"][0] = 0.0
    still = example["program"]([], [])
    still.data.parameters["velocity_down"][0] = 0.0
    for _ in range(5):
        ours, plain = engine.solve(), still.solve()
    np.testing.assert_allclose(ours.thrusts, plain.thrusts, atol=1e-3)
    assert shipped is not None
