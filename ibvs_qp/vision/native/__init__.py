"""Inner loops of vision as machine code, where there is a C compiler; calls on small arrays cost most of a picture.

The C files of this folder are joined into one and translated once. The numpy code beside them says what they compute;
both agree to rounding, and numpy serves where there is no compiler.
"""

from __future__ import annotations

import ctypes
import functools
import logging
import platform
import subprocess
from pathlib import Path

import numpy as np

from ibvs_qp.model.shared_library import compiler, shared_library, wide_registers

#: The files, in the order in which they are joined.
FILES = (
    "native.h",
    "edges.c",
    "line_fit.c",
    "fit_lines.c",
    "samples.c",
    "board.c",
    "planes.c",
    "hypotheses.c",
    "thin.c",
    "votes.c",
    "sides.c",
    "flow.c",
)
#: Products and sums are not contracted, so that all processors of one kind agree.
FLAGS = ("-O3", "-fPIC", "-shared", "-ffp-contract=off")

log = logging.getLogger(__name__)


@functools.cache
def native() -> ctypes.CDLL | None:
    """The translated functions, or None where they cannot be had."""
    command = compiler()
    if command is None:
        log.info("no C compiler: vision runs on numpy")
        return None
    try:
        folder = Path(__file__).parent
        code = "".join((folder / name).read_text() for name in FILES)
        return ctypes.CDLL(str(shared_library("vision", code, command, (*FLAGS, *wide_registers()))))
    except (OSError, subprocess.SubprocessError) as error:
        log.warning("vision runs on numpy: %s", error)
        return None


def _asked(array: np.ndarray | None) -> ctypes.c_void_p:
    return ctypes.c_void_p(None if array is None else array.__array_interface__["data"][0])


#: Size of what every object begins with [bytes].
_HEAD = object.__basicsize__
_NULL = ctypes.c_void_p(None)


def _read(array: np.ndarray | None, _at=ctypes.c_void_p.from_address, _pointer=ctypes.c_void_p) -> ctypes.c_void_p:
    # the first field of an array behind the object's head; a tenth of the time, and a search asks for a hundred
    return _NULL if array is None else _pointer(_at(id(array) + _HEAD).value)


def _readable() -> bool:
    """Whether arrays of this numpy and this Python begin as their interface in C says."""
    if platform.python_implementation() != "CPython":
        return False
    tried = np.zeros((4, 3)), np.zeros(5, np.uint8)[2:]
    return all(_read(array).value == _asked(array).value for array in tried)


_place = _read if _readable() else _asked


def place(array: np.ndarray | None) -> ctypes.c_void_p:
    """Where an array lies in memory, NULL without one; the array must outlive the call, and be contiguous."""
    return _place(array)
