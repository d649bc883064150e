"""Moved modules under their former names: the same module, with a warning."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from ibvs_qp.former_names import MOVED, present_name

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
