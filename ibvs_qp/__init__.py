"""Aerial manipulation by one quadratic program per tick: the drop-in controller and its types."""

from __future__ import annotations

import sys
from typing import Any

from ibvs_qp.former_names import FormerNames
from ibvs_qp.lazy import public_names

sys.meta_path.insert(0, FormerNames())
_load, _names = public_names(__name__, __file__)
__all__ = [*_names, "__version__"]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """A public name, from the module that defines it."""
    if name == "__version__":
        from importlib.metadata import version

        return version("ibvs-qp")
    return _load(name)
