"""Modules that have moved load under their former names, with a `DeprecationWarning` (docs/api-stability.md)."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

#: Former names of folders and modules, and the present ones.
MOVED = {
    "ibvs_qp.adapters.px4_rotors": "ibvs_qp.interfaces.px4.rotors",
    "ibvs_qp.adapters.px4": "ibvs_qp.interfaces.px4.rotors",
    "ibvs_qp.adapters": "ibvs_qp.interfaces.px4",
    "ibvs_qp.bridge": "ibvs_qp.interfaces.px4",
    "ibvs_qp.export": "ibvs_qp.interfaces.c_library",
    "ibvs_qp.painting": "ibvs_qp.pilot.painting",
    "ibvs_qp.presets": "ibvs_qp.pilot.presets",
    "ibvs_qp.recording": "ibvs_qp.interfaces.log",
    "ibvs_qp.ros.held": "ibvs_qp.interfaces.ros.latest_samples",
    "ibvs_qp.ros": "ibvs_qp.interfaces.ros",
}


def present_name(name: str) -> str | None:
    """Name of a module today, None for one that has not moved."""
    for former, present in MOVED.items():
        if name == former or name.startswith(f"{former}."):
            return present + name.removeprefix(former)
    return None


class FormerNames(MetaPathFinder, Loader):
    """Finds moved modules: both names are one module."""

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> ModuleSpec:
        """The specification of a moved module, None for all others."""
        return ModuleSpec(name, self) if present_name(name) else None  # pyright: ignore[reportReturnType]

    def exec_module(self, module: ModuleType) -> None:
        """Put the module of today in the place of the former one."""
        name, present = module.__name__, str(present_name(module.__name__))
        warnings.warn(f"{name} is {present} now", DeprecationWarning, stacklevel=2)
        sys.modules[name] = importlib.import_module(present)
