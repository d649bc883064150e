"""Inner loops of vision as machine code, where there is a C compiler; calls on small arrays cost most of a picture.

The C files of this folder are joined into one and translated once. The numpy code beside them says what they compute;
both agree to rounding, and numpy serves where there is no compiler.
"""

from __future__ import annotations

import ctypes
import functools
import logging
import subprocess
from pathlib import Path

import numpy as np

from ibvs_qp.symbolic.compiler import compiler, wide_registers
from ibvs_qp.symbolic.shared_library import shared_library

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
        return ctypes.CDLL(str(shared_library("vision", {"vision.c": code}, command, (*FLAGS, *wide_registers()))))
    except (OSError, subprocess.SubprocessError) as error:
        log.warning("vision runs on numpy: %s", error)
        return None


def place(array: np.ndarray | None) -> ctypes.c_void_p:
    """Address of an array's data, NULL without one; the array must outlive the call, and be contiguous."""
    return ctypes.c_void_p(None if array is None else array.ctypes.data)
