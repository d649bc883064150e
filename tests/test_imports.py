"""Imports run one way: allocation <- ibvs_qp <- sim <- notebooks, and the controller knows no simulator."""

from __future__ import annotations

import ast
import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: What every package must not import.
FORBIDDEN = {
    "allocation": {"ibvs_qp", "sim", "notebooks", "mujoco", "casadi", "osqp", "cv2"},
    "ibvs_qp": {"sim", "notebooks", "mujoco", "matplotlib", "rich", "tyro"},
    "sim": {"notebooks", "tests"},
}


def imported_names(text: str, package: str) -> set[str]:
    """Top-level names imported anywhere in a module's text, also inside functions; relative ones are the package's."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(package if node.level else (node.module or "").split(".")[0])
    return names


@pytest.mark.parametrize("package", FORBIDDEN)
def test_imports_run_one_way(package):
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    for file in files:
        wrong = imported_names(file.read_text(encoding="utf-8"), package) & FORBIDDEN[package]
        assert not wrong, f"{file.relative_to(ROOT)} imports {', '.join(sorted(wrong))}"


def test_the_check_sees_every_kind_of_import():
    text = "import osqp as o, sim.world.plant\ndef f():\n    from mujoco.x import y\n    from ..frames import skew\n"
    assert imported_names(text, "ibvs_qp") == {"osqp", "sim", "mujoco", "ibvs_qp"}


def test_packages_are_the_installed_ones():
    """A stranger's top-level ``sim`` or ``allocation`` must not shadow ours."""
    places = {name: importlib.util.find_spec(name) for name in FORBIDDEN}
    parents = {Path(spec.origin).parents[1] for spec in places.values() if spec and spec.origin}
    assert len(parents) == 1


def test_controller_loads_where_the_simulator_cannot():
    code = (
        "import sys\n"
        "class Block:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.split('.')[0] in ('sim', 'mujoco', 'matplotlib'):\n"
        "            raise ImportError(name)\n"
        "sys.meta_path.insert(0, Block())\n"
        "import pkgutil, importlib, ibvs_qp\n"
        "for module in pkgutil.walk_packages(ibvs_qp.__path__, 'ibvs_qp.'):\n"
        "    importlib.import_module(module.name)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
