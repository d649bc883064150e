"""Inner loops of vision, compiled by numba, which OpenCV and NumPy lack, or offer only by many calls on small arrays.

A kernel is one Python function with the types of its arguments. `prepare` compiles all of them, once: numba keeps the
machine code next to the source, or in the user's cache folder where the package cannot be written.
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np

log = logging.getLogger(__name__)

#: Standard deviation of a normal distribution over its median absolute deviation.
MAD_TO_SIGMA = 1.4826
#: Every kernel that was imported, with its signature.
KERNELS: list[tuple[Any, Any]] = []
#: Time of the last change of any file with a part of kernels: numba itself watches only the file of the kernel. A time
#: in the future is of another clock and does not count, or every start would compile.
_changed = [0.0]


def inner(function: Callable[..., Any]) -> Any:
    """A part of kernels, compiled with them for the types that they pass.

    Fractions by zero are those of IEEE 754, sums keep their order, and products and sums are not contracted: all
    processors give the same bits.
    """
    changed = Path(function.__code__.co_filename).stat().st_mtime
    if changed <= time.time():
        _changed[0] = max(_changed[0], changed)
    return numba.njit(nogil=True, error_model="numpy")(function)


def kernel(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function for one signature, at the latest when it is first called.

    Args:
        signature: Types of result and arguments, by numba's types or in its words, such as ``"i8(f8[:, ::1], u1)"``.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        compiled = inner(function)
        if compiled is function:  # NUMBA_DISABLE_JIT=1, to debug or to measure coverage: slow, the same numbers
            return compiled
        with contextlib.suppress(RuntimeError):  # neither the package nor the user's cache folder can be written
            compiled.enable_caching()
        for index in _stored(compiled):
            with contextlib.suppress(FileNotFoundError):  # another process was faster
                if index.stat().st_mtime < _changed[0]:
                    index.unlink()
        KERNELS.append((compiled, signature))
        return compiled

    return decorate


def prepare() -> None:
    """Compile all imported kernels, with one line in the log: the first time it takes up to 25 s."""
    if not all(compiled.signatures or _stored(compiled) for compiled, _ in KERNELS):
        log.warning("vision is compiled, once: up to 25 s")
    for compiled, signature in KERNELS:
        if not compiled.signatures:
            compiled.compile(signature)


def _stored(compiled: Any) -> list[Path]:
    """Files that list the stored machine code of a kernel."""
    folder, function = compiled.stats.cache_path, compiled.py_func
    module = function.__module__.rpartition(".")[2]
    return [] if folder is None else list(Path(folder).glob(f"{module}.{function.__name__}-*.nbi"))


def median(values: np.ndarray) -> float:
    """Upper median of a one-dimensional array; ten times faster than numpy's on the short arrays of this package."""
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])


def middle(values: np.ndarray) -> float:
    """Median of a one-dimensional array, the mean of the two middle values of an even number."""
    values, count = np.sort(values), len(values)
    return 0.5 * float(values[(count - 1) // 2] + values[count // 2])


@inner
def upper_median(values, count):
    """Upper median of the first `count` values, which it reorders (quickselect); infinite without any."""
    if count == 0:
        return np.inf
    low, high, middle = 0, count - 1, count // 2
    while low < high:
        pivot = values[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            break
    return values[middle]
