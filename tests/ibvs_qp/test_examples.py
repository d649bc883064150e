"""Every example runs, without the simulator, and does what its text says."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ibvs_qp.controller import HybridController

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
NUMBER = re.compile(r"-?\d+\.\d+")
#: Presets hold the settings of perception, which needs OpenCV; the controller alone does not.
WITHOUT_OPENCV = ("plain_python", "my_task")
#: Runs a script where the simulator and everything that draws cannot be imported.
ALONE = """
import importlib.abc, runpy, sys

class Missing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("sim", "mujoco", "matplotlib", "tests", *sys.argv[2:]):
            raise ImportError(f"{name} is not installed here")

sys.meta_path.insert(0, Missing())
runpy.run_path(sys.argv[1], run_name="__main__")
"""


def run(script: Path) -> str:
    command = [sys.executable, "-c", ALONE, str(script), *(["cv2"] if script.stem in WITHOUT_OPENCV else [])]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def printed() -> dict[str, str]:
    assert {*WITHOUT_OPENCV, "own_vehicle"} <= {script.stem for script in EXAMPLES}
    return {script.stem: run(script) for script in EXAMPLES}


def test_every_example_runs_and_prints(printed: dict[str, str]) -> None:
    assert all(text.strip() for text in printed.values())


def test_plain_python_presses_and_slides(printed: dict[str, str]) -> None:
    rows = re.findall(
        r"([\d.]+) s +(\w+) +push +(-?[\d.]+) N +height error +([-+][\d.]+) mm +slid +([-+][\d.]+) m +(\w+)",
        printed["plain_python"],
    )
    assert len(rows) == 12
    pressed = [row for row in rows if float(row[0]) >= 5.0]  # the last centimetre is flown at 12 mm/s
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
        [float(number) for number in NUMBER.findall(line)] for line in printed["my_task"].splitlines()
    )
    # Front rotors (two), climb, price.
    assert max(quiet[:2]) < 5.0 < 9.0 < min(shipped[:2])
    assert quiet[2] == pytest.approx(shipped[2], abs=0.01)
    assert 0.5 <= limited[2] <= 0.65 and limited[3] > 10.0 and shipped[3] == quiet[3] == 0.0
    text = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    told = text[text.index("as shipped ") :].splitlines()
    for line, ours in zip(told, printed["my_task"].splitlines(), strict=False):
        assert NUMBER.sub("", line).split() == NUMBER.sub("", ours).split()
        numbers = [[float(number) for number in NUMBER.findall(words)] for words in (line, ours)]
        assert numbers[0] == pytest.approx(numbers[1], rel=0.01, abs=0.02)


def test_added_rows_are_named_and_absent_by_weight_zero() -> None:
    example = runpy.run_path(str(ROOT / "examples" / "my_task.py"))
    quiet, climb = example["QuietRotors"]("r0", "r7"), example["ClimbLimit"](50.0)
    controller = HybridController(example["CONFIG"], tasks=[quiet], limits=[climb])
    plain = HybridController(example["CONFIG"])
    names = [row.name for row in controller.problem.task_rows]
    assert names[-2:] == ["quiet_r0", "quiet_r7"] and controller.problem.row_names[-1] == "climb"
    assert controller.problem.variable_names[-1] == "slack_climb"
    quiet.set_target(4.0)
    command = controller.step(example["HOVER"], example["RISE"])
    assert {"quiet_r0", "quiet_r7"} <= {task.name for task in command.tasks}
    controller.reset()
    quiet.set_target(4.0, weight=0.0)
    ours, theirs = (one.step(example["HOVER"], example["RISE"]) for one in (controller, plain))
    np.testing.assert_allclose(ours.wrench, theirs.wrench, atol=5e-3)
    # Not the thrusts: what two redundant rotors share is left to the pull to the last thrusts, a thousand times weaker.
    assert "quiet_r0" not in {task.name for task in ours.tasks}


def test_the_own_vehicle_hovers(printed: dict[str, str]) -> None:
    text = printed["own_vehicle"]
    assert "not actuated: nothing" in text and "solved: thrusts" in text
    low, high, push = map(float, re.findall(r"hover: ([\d.]+) to ([\d.]+) N; greatest push ([\d.]+) N", text)[0])
    assert 8.0 < low <= high < 12.0 and push > 20.0
