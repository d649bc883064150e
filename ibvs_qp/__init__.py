"""Aerial manipulation by one quadratic program per tick: the drop-in controller and its types.

The names load on first use: a program that only checks its command line need not wait for solvers and OpenCV.
"""

import ast
import importlib
from pathlib import Path
from typing import Any

# pyright: reportUnsupportedDunderAll=false

#: Modules of the public names; the list is the stub `__init__.pyi`, which type checkers read.
_HOME_OF = {
    alias.name: str(node.module)
    for node in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}
__all__ = [*_HOME_OF, "__version__"]


def __getattr__(name: str) -> Any:
    """Import a public name where it lives."""
    if name == "__version__":
        from importlib.metadata import version

        return version("ibvs-qp")
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME_OF[name]), name)
