"""Compilation of the kernels, and the one line about it."""

from __future__ import annotations

import contextlib
import functools
import importlib
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

#: Numbers of a fraction by zero are those of IEEE 754, sums keep their order, and products and sums are not contracted:
#: all processors give the same bits.
_OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": False}

log = logging.getLogger(__name__)
_kernels: list[tuple[Any, str]] = []


def kernel(signature: str) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function for one signature, at the latest when it is first called.

    Args:
        signature: Types of result and arguments in numba's words, such as ``"i8(f8[:, ::1], u1[::1])"``.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        compiled = _cached(function)
        _kernels.append((compiled, signature))
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
    for index in _indices(compiled):
        with contextlib.suppress(FileNotFoundError):  # another process was faster
            if index.stat().st_mtime < _newest():
                index.unlink()
    return compiled


@functools.cache
def _newest() -> float:
    """Time of the last change of any kernel: numba itself watches only the file of an entry point."""
    return max(file.stat().st_mtime for file in Path(__file__).parent.glob("*.py"))


def _indices(compiled: Any) -> list[Path]:
    """Files that list the stored machine code of a kernel."""
    folder, function = compiled.stats.cache_path, compiled.py_func
    module = function.__module__.rpartition(".")[2]
    return [] if folder is None else list(Path(folder).glob(f"{module}.{function.__name__}-*.nbi"))


def prepare() -> None:
    """Compile every kernel that is not yet, and say so in one line: the first time it takes up to 25 s."""
    importlib.import_module("ibvs_qp.vision.kernels.everything")
    if not all(compiled.signatures or _indices(compiled) for compiled, _ in _kernels):
        log.warning("vision is compiled, once: up to 25 s")
    for compiled, signature in _kernels:
        if not compiled.signatures:
            compiled.compile(signature)
