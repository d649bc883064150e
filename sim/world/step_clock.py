"""MuJoCo's clock: it times every stage of every step, for statistics that nobody here looks at."""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import ctypes
import functools
from pathlib import Path

import mujoco

#: MuJoCo's pointer to the function that tells the time; where it points nowhere, nothing is timed.
CLOCK = "mjcb_time"


@functools.cache
def stop_step_clock() -> bool:
    """Have MuJoCo step without reading the clock: a fifth less work per step, and ``mjData.timer`` stays zero.

    It holds for the whole process. A clock that somebody has set of his own goes on, and so does MuJoCo's own where its
    library has another name; its Python binding takes no pointer to nowhere.

    Returns:
        Whether the clock stands.
    """
    if mujoco.get_mjcb_time() is not None:
        return False
    for file in sorted(Path(mujoco.__file__).parent.glob("*mujoco*")):
        if file.is_file() and file.suffix not in (".py", ".pyi"):
            try:
                ctypes.c_void_p.in_dll(ctypes.CDLL(str(file)), CLOCK).value = None
            except (OSError, ValueError):
                continue
            return True
    return False
