"""The controller as a module to drop in: packages that it loads, a light installation, modules by former names."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from ibvs_qp.former_names import MOVED, present_name

ROOT = Path(__file__).parents[2]
#: The light installation: these, what they need themselves, and nothing else from a package registry.
LIGHT = ("numpy", "scipy", "casadi", "osqp", "qpsolvers")
#: Parts of scipy that cost half a second and that no flight needs.
HEAVY = {f"scipy.{part}" for part in ("optimize", "linalg", "spatial", "stats", "ndimage", "signal")}
#: Refuses every other installed package, and the packages above the controller.
HIDE = f"""
import importlib.metadata, re, sys

light, new = set(), {set(LIGHT)}
while new:
    light |= new
    needed = [entry for name in new for entry in importlib.metadata.requires(name) or () if "extra ==" not in entry]
    new = {{re.split("[^A-Za-z0-9_.-]", entry)[0].lower() for entry in needed}} - light
owners = importlib.metadata.packages_distributions()
hidden = {{name for name, found in owners.items() if not light & {{each.lower() for each in found}}}}
hidden = (hidden | {{"sim", "notebooks"}}) - {{"ibvs_qp", "allocation"}}

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in hidden:
            raise ModuleNotFoundError(f"{{name}} is not installed here", name=name)

sys.meta_path.insert(0, Missing())
assert {{"cv2", "numba", "mujoco", "matplotlib", "tomli_w", "polars", "tyro", "mcap", "sim"}} <= hidden
"""
LOAD_AND_FLY = (
    HIDE
    + """
import numpy as np
from ibvs_qp import Assured, ControllerConfig, HybridController, Measurement, PaperController, Reference
CONFIG
for controller in (HybridController(config), PaperController(config), Assured(HybridController(config))):
    for tick in range(1, TICKS):
        command = controller.step(
            Measurement(
                stamp_ns=tick * 4_000_000, attitude=np.array([1.0, 0.0, 0.0, 0.0]), angular_velocity=np.zeros(3),
                specific_force=np.array([0.0, 0.0, -9.81]), contact_wrench=np.zeros(6),
                wrench_stamp_ns=tick * 4_000_000, plane=(0.0, 0.0, 1.25, -1.0), plane_stamp_ns=tick * 4_000_000,
            ),
            Reference(standoff=0.2),
        )
        assert command.outcome == "solved" and command.rejected == () and command.safety == "nominal", command
print(" ".join(sorted(sys.modules)))
"""
)


def loaded(code: str) -> set[str]:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


@pytest.mark.parametrize("config", ["from ibvs_qp import preset; config = preset().controller", "config = None"])
def test_the_laws_and_assured_fly_in_a_light_installation(config: str) -> None:
    modules = loaded(LOAD_AND_FLY.replace("CONFIG", config).replace("TICKS", "50"))
    assert {"osqp", "scipy.sparse", "ibvs_qp.supervision.supervision"} <= modules


def test_a_tick_of_the_laws_loads_no_heavy_part_of_scipy() -> None:
    code = LOAD_AND_FLY.replace("CONFIG", "config = None").replace(", Assured(HybridController(config))", "")
    code = code.replace("import Assured, ", "import ")
    assert not loaded(code.replace("TICKS", "2")) & (HEAVY | {"qpsolvers", "ibvs_qp.supervision.assured"})


def test_every_module_below_vision_loads_in_a_light_installation() -> None:
    rooms = (
        "estimation interfaces.c_library limits model pilot.painting qp supervision symbolic tasks validation".split()
    )
    walk = (
        "import importlib, pkgutil\n"
        f"for room in map(importlib.import_module, {[f'ibvs_qp.{room}' for room in rooms]}):\n"
        "    for module in pkgutil.walk_packages(room.__path__, room.__name__ + '.'):\n"
        "        if not module.name.startswith('ibvs_qp.qp.solvers.') or module.name.endswith('.osqp'):\n"
        "            importlib.import_module(module.name)\n"
        "print(*sys.modules)"
    )
    assert {f"ibvs_qp.{room}" for room in rooms} <= loaded(HIDE + walk)


def test_importing_the_controller_loads_numpy_and_casadi_alone() -> None:
    """Solver and scipy come with the first controller: the import takes half of the time without them."""
    names = "ControllerConfig, HybridController, Measurement, PaperController, Reference"
    modules = loaded(f"import sys\nfrom ibvs_qp import {names}\nprint(' '.join(sorted(sys.modules)))")
    assert not {name.split(".")[0] for name in modules} & {"scipy", "osqp", "qpsolvers", "jinja2", "tomli_w", "cv2"}
    # Of the own packages only the laws: no painting strategy or pilot, and of vision one matrix.
    parts = {name for name in modules if name.split(".")[0] == "ibvs_qp"}
    assert not parts & {"ibvs_qp.pilot.painting.painter", "ibvs_qp.pilot", "ibvs_qp.supervision.rotor_monitor"}
    assert not any(name.startswith("ibvs_qp.vision") for name in parts)


def test_supervision_and_estimation_load_no_scipy_either() -> None:
    code = "import sys, ibvs_qp.estimation.estimator\nfrom ibvs_qp import Assured\nprint(*sys.modules)"
    assert not {name.split(".")[0] for name in loaded(code)} & {"scipy", "osqp", "qpsolvers", "cv2"}


def test_a_command_line_check_loads_no_solver() -> None:
    modules = loaded("import sys, ibvs_qp, allocation, ibvs_qp.vision\nprint(' '.join(sorted(sys.modules)))")
    assert not modules & {"casadi", "osqp", "scipy", "cv2"}


PAGES = ["ibvs_qp", "ibvs_qp.pilot", "ibvs_qp.vision", "ibvs_qp.vision.paper"]


@pytest.mark.parametrize("package", PAGES)
def test_every_lazy_name_is_the_thing_itself(package: str) -> None:
    """A module of the same name as a function would hide it from the second import on."""
    module = importlib.import_module(package)
    for _ in range(2):
        for name in module.__all__:
            found = getattr(module, name)
            assert type(found).__name__ != "module", name
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        getattr(module, "nonsense")  # noqa: B009 - a type checker knows that it is not there


def test_the_readme_snippet_runs() -> None:
    """What a newcomer copies, word for word, where the simulator is not installed."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    section = text[text.index("## Dropping the controller into your stack") :]
    snippet = section.split("```python\n")[1].split("```")[0]
    modules = loaded(HIDE + snippet + "\nassert command.outcome == 'solved'\nprint(' '.join(sorted(sys.modules)))")
    assert "ibvs_qp.controller" in modules and "mujoco" not in modules


#: Former public names, and those that `examples` and the documentation once used.
FORMER = [
    ("ibvs_qp.adapters.px4", "to_px4"),
    ("ibvs_qp.adapters.px4_rotors", "from_px4"),
    ("ibvs_qp.adapters.thrust_curve", "ThrustCurve"),
    ("ibvs_qp.bridge.config", "BridgeConfig"),
    ("ibvs_qp.export.library", "write_library"),
    ("ibvs_qp.painting.config", "PaintingConfig"),
    ("ibvs_qp.painting.presser", "Presser"),
    ("ibvs_qp.presets", "preset"),
    ("ibvs_qp.recording", "read_log"),
    ("ibvs_qp.ros.bag", "Bag"),
    ("ibvs_qp.ros.topics", "Topics"),
    ("ibvs_qp.ros.write_bag", "write_bag"),
]


@pytest.fixture
def forgotten() -> None:
    """No module is loaded under a former name."""
    for name in [name for name in sys.modules if present_name(name)]:
        del sys.modules[name]


@pytest.mark.usefixtures("forgotten")
@pytest.mark.parametrize(("module", "name"), FORMER)
def test_a_former_name_is_the_module_of_today(module: str, name: str) -> None:
    present = str(present_name(module))
    with pytest.warns(DeprecationWarning) as warnings:
        found = importlib.import_module(module)
    assert f"{module} is {present} now" in [str(warning.message) for warning in warnings]
    assert found is importlib.import_module(present) and hasattr(found, name)


def test_every_present_name_exists_and_no_former_one_does() -> None:
    for present in MOVED.values():
        assert importlib.import_module(present).__name__ == present
    assert present_name("ibvs_qp.painting_robot") is None and present_name("ibvs_qp.pilot") is None


def test_a_fresh_process_finds_a_nested_former_module_once() -> None:
    code = (
        "import warnings; warnings.simplefilter('ignore')\n"
        "from ibvs_qp.painting.strategy import Strategy\n"
        "import ibvs_qp, sys\n"
        "assert Strategy is ibvs_qp.Strategy\n"
        "assert sys.modules['ibvs_qp.painting.strategy'] is sys.modules['ibvs_qp.pilot.painting.strategy']\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
