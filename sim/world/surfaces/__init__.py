"""Shapes of the wall by the name of their kind; every module of this folder adds its own."""

from __future__ import annotations

import importlib
import pkgutil

from sim.world.surfaces.surface import KINDS, SIDES, Surface

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

__all__ = ["KINDS", "SIDES", "Surface"]
