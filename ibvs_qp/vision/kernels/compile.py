"""How a function becomes a kernel, and where its machine code is stored."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

#: Numbers of a fraction by zero are those of IEEE 754, sums keep their order, and products and sums are not contracted:
#: all processors give the same bits.
_OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": False}

#: Every kernel that was imported, with its signature.
KERNELS: list[tuple[Any, str]] = []


def kernel(signature: str) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function for one signature, at the latest when it is first called.

    Args:
        signature: Types of result and arguments in numba's words, such as ``"i8(f8[:, ::1], u1[::1])"``.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        compiled = _cached(function)
        KERNELS.append((compiled, signature))
        return compiled

    return decorate


def inner(function: Callable[..., Any]) -> Any:
    """A part of kernels, compiled with them for the types that they pass."""
    return _cached(function)


def _cached(function: Callable[..., Any]) -> Any:
    try:
        compiled = numba.njit(cache=True, **_OPTIONS)(function)
    except RuntimeError:  # neither the package nor the user's cache folder can be written
        return numba.njit(**_OPTIONS)(function)
    for index in stored(compiled):
        with contextlib.suppress(FileNotFoundError):  # another process was faster
            if index.stat().st_mtime < _newest():
                index.unlink()
    return compiled


@functools.cache
def _newest() -> float:
    """Time of the last change of any kernel: numba itself watches only the file of an entry point."""
    return max(file.stat().st_mtime for file in Path(__file__).parent.glob("*.py"))


def stored(compiled: Any) -> list[Path]:
    """Files that list the stored machine code of a kernel."""
    folder, function = compiled.stats.cache_path, compiled.py_func
    module = function.__module__.rpartition(".")[2]
    return [] if folder is None else list(Path(folder).glob(f"{module}.{function.__name__}-*.nbi"))
