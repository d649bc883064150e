"""The controller as a module to drop in: what loading it pulls in, and what it does without."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: Packages that flying the controller with lines and planes of one's own must not need.
NOT_NEEDED = {
    *("sim", "notebooks", "mujoco", "matplotlib", "cv2", "rich", "tyro", "joblib", "qpsolvers", "optuna"),
    *("scipy.optimize", "scipy.linalg", "scipy.spatial", "scipy.stats", "scipy.ndimage", "scipy.signal"),
}
LOAD_AND_FLY = """
import importlib.abc, sys

class Missing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("sim", "notebooks", "mujoco", "matplotlib", "cv2", "rich", "tyro"):
            raise ImportError(f"{name} is not installed here")

sys.meta_path.insert(0, Missing())
import numpy as np
from ibvs_qp import ControllerConfig, HybridController, Measurement, PaperController, Reference

for controller in (HybridController(), PaperController()):
    command = controller.step(
        Measurement(
            stamp_ns=4_000_000, attitude=np.array([1.0, 0.0, 0.0, 0.0]), angular_velocity=np.zeros(3),
            specific_force=np.array([0.0, 0.0, -9.81]), contact_wrench=np.zeros(6), wrench_stamp_ns=4_000_000,
            plane=(0.0, 0.0, 1.25, -1.0), plane_stamp_ns=4_000_000,
        ),
        Reference(standoff=0.2),
    )
    assert command.outcome == "solved" and command.rejected == (), command
print(" ".join(sorted(sys.modules)))
"""


def loaded(code: str) -> set[str]:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


def test_flying_the_controller_loads_nothing_it_does_not_need() -> None:
    modules = loaded(LOAD_AND_FLY)
    # scipy.sparse comes with OSQP; the rest of scipy costs half a second that nobody flying needs.
    leaked = {name for name in modules if name in NOT_NEEDED or name.split(".")[0] in NOT_NEEDED}
    assert leaked == set()


def test_importing_the_controller_adds_little_to_numpy_casadi_and_osqp() -> None:
    """What costs time at the import: beyond the three packages that every tick uses, own files and a TOML writer."""
    needed = loaded("import sys, numpy, casadi, osqp\nprint(' '.join(sorted(sys.modules)))")
    names = "ControllerConfig, HybridController, Measurement, PaperController, Reference"
    modules = loaded(f"import sys\nfrom ibvs_qp import {names}\nprint(' '.join(sorted(sys.modules)))")
    added = {name.split(".")[0] for name in modules - needed}
    assert added - set(sys.stdlib_module_names) == {"allocation", "ibvs_qp", "tomli_w"}
    # Of the own packages only what flies: no painting strategy or pilot, and of vision one matrix.
    parts = {name for name in modules if name.split(".")[0] == "ibvs_qp"}
    assert not parts & {"ibvs_qp.painting.painter", "ibvs_qp.pilot", "ibvs_qp.supervision.rotor_loss"}
    assert not any(name.startswith("ibvs_qp.vision") for name in parts)
    # scipy.sparse comes with OSQP, the heavy parts of scipy with nothing.
    public = {name.split(".")[1] for name in modules if name.startswith("scipy.")}
    assert {name for name in public if not name.startswith("_")} == {"sparse", "version"}


def test_a_command_line_check_loads_no_solver() -> None:
    modules = loaded("import sys, ibvs_qp, allocation, ibvs_qp.vision\nprint(' '.join(sorted(sys.modules)))")
    assert not modules & {"casadi", "osqp", "scipy", "cv2"}


@pytest.mark.parametrize("package", ["ibvs_qp", "ibvs_qp.vision"])
def test_every_lazy_name_is_the_thing_itself(package: str) -> None:
    """A module of the same name as a function would hide it from the second import on."""
    module = importlib.import_module(package)
    for _ in range(2):
        for name in module.__all__:
            found = getattr(module, name)
            assert type(found).__name__ != "module", name
    homes = {home.rpartition(".")[2] for home in module._HOMES}
    assert not homes & set(module.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        getattr(module, "nonsense")  # noqa: B009 - a type checker knows that it is not there


def test_the_readme_snippet_runs() -> None:
    """What a newcomer copies, word for word, where the simulator is not installed."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    section = text[text.index("## Dropping the controller into your stack") :]
    snippet = section.split("```python\n")[1].split("```")[0]
    header = LOAD_AND_FLY[: LOAD_AND_FLY.index("import numpy")]
    modules = loaded(header + snippet + "\nassert command.outcome == 'solved'\nprint(' '.join(sorted(sys.modules)))")
    assert "ibvs_qp.controller" in modules and "mujoco" not in modules
