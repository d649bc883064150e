"""Imports run one way: allocation <- ibvs_qp <- sim <- notebooks, and the controller imports no simulator."""

from __future__ import annotations

import ast
import importlib.util
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: Folders in the order of their imports: each imports only from earlier ones (docs/development.md).
ORDER = {
    "ibvs_qp": (
        "former_names lazy quaternion frames measurement command axes config flight_state symbolic validation "
        "estimation model tasks limits qp vision checked_law analytic controller supervision pilot interfaces"
    ).split(),
    "sim": (
        "storage world scenes vehicles sensors rivals faults flight video evaluate scene_fuzz figures sweep report "
        "detection experiments fault_matrix tune gym_env live bench notebook commands"
    ).split(),
}
#: Parts of a folder in the order of their imports. Those of vision are its stages: data passes forward.
PARTS = {
    "vision": ("compilation config checks picture appearance surface flow lines perception paper").split(),
    "pilot": "painting config pilot presets".split(),
    "interfaces": "overlay c_library log ros px4".split(),
}
#: Most folders of the controller: more than a newcomer keeps in mind are too many.
MOST_ROOMS = 12
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


def imported_modules(package: str) -> dict[str, set[str]]:
    """Modules of a package, and what each imports of it: inside functions and under TYPE_CHECKING as well."""
    files = {".".join(file.relative_to(ROOT).with_suffix("").parts): file for file in (ROOT / package).rglob("*.py")}
    files = {name.removesuffix(".__init__"): file for name, file in files.items()}
    found: dict[str, set[str]] = {}
    for name, file in files.items():
        used: set[str] = set()
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                used |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                whole = {f"{node.module}.{alias.name}" for alias in node.names}
                used |= {module if module in files else node.module for module in whole}
        found[name] = {module for module in used if module in files and module != name}
    return found


@pytest.mark.parametrize("package", ORDER)
def test_rooms_depend_one_way(package: str) -> None:
    order = ORDER[package]
    rooms = {
        path.stem for path in (ROOT / package).iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()
    }
    assert rooms - {"__init__"} == set(order)
    for name, used in imported_modules(package).items():
        room = name.split(".")[1] if "." in name else None
        for other in used:
            if room is None or other == package or other.split(".")[1] == room:
                continue  # the package's own page of public names, and modules of one room
            later = order.index(other.split(".")[1]) > order.index(room)
            assert not later, f"{name} imports {other}: {room} stands before {other.split('.')[1]}"


def test_the_controller_has_few_folders() -> None:
    assert len([file for file in (ROOT / "ibvs_qp").iterdir() if (file / "__init__.py").exists()]) <= MOST_ROOMS


@pytest.mark.parametrize("folder", PARTS)
def test_no_part_of_a_folder_reaches_back(folder: str) -> None:
    order = PARTS[folder]
    for name, used in imported_modules("ibvs_qp").items():
        part = part_of(name, folder)
        for other in used:
            later = None not in (part, part_of(other, folder)) and order.index(part_of(other, folder)) > order.index(
                part
            )
            assert not later, f"{name} imports {other}: {part} stands before {part_of(other, folder)}"


def part_of(module: str, folder: str) -> str | None:
    """Part of a folder that a module is in, None outside."""
    parts = module.split(".")
    return parts[2] if parts[:2] == ["ibvs_qp", folder] and len(parts) > 2 and parts[2] in PARTS[folder] else None


@pytest.mark.parametrize("package", ORDER)
def test_no_module_imports_itself_in_a_circle(package: str) -> None:
    graph = imported_modules(package)
    lazy = {package, f"{package}.vision"}  # pages of public names that load on first use
    try:
        tuple(TopologicalSorter({name: used - lazy for name, used in graph.items() if name not in lazy}).static_order())
    except CycleError as circle:
        pytest.fail(f"imports in a circle: {' -> '.join(circle.args[1])}")
