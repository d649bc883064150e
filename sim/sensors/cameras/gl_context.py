"""A headless OpenGL context: EGL if there is one, else OSMesa; libraries are loaded on first use.

MuJoCo picks its own context by the environment variable MUJOCO_GL when it is imported, and fails at import where the
library is missing. So the variable is never set here: the context is independent of MuJoCo's choice.
"""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import importlib
import os
import sys
from typing import Any

from ibvs_qp.config.errors import IbvsQpError

#: Platforms in the order in which they are tried.
PLATFORMS = ("egl", "osmesa")
#: Packages to install without a platform.
_REMEDY = "install libegl1 and libgl1-mesa-dri for it"
#: Which platform PyOpenGL binds to; it reads this once, at its import.
_PLATFORM_VARIABLE = "PYOPENGL_PLATFORM"


class CameraUnavailable(IbvsQpError):
    """This machine cannot draw with that camera back end."""


def open_context(width: int, height: int, platforms: tuple[str, ...] = PLATFORMS) -> tuple[Any, str]:
    """Make an OpenGL context and make it current in this thread.

    Args:
        width: Largest picture drawn [px].
        height: Its height [px].
        platforms: Platforms to try in turn, of `PLATFORMS`.

    Returns:
        MuJoCo's context object (``make_current``, ``free``) and the platform's name.

    Raises:
        CameraUnavailable: When no platform works, with the reason for each and the packages to install.
    """
    os.environ.setdefault("LP_NUM_THREADS", "1")  # software rendering: leaves the other cores to other processes
    reasons = []
    for platform in platforms:
        foreign = "OpenGL" in sys.modules or _PLATFORM_VARIABLE in os.environ
        try:
            context = _load(platform).GLContext(width, height)
            _prove(context)
            return context, platform
        except Exception as error:  # missing libraries surface as AttributeError, ImportError, GLError, FatalError
            reasons.append(f"{platform}: {_short(error)}")
            if not foreign:  # PyOpenGL is bound to this platform now; the next one needs a fresh one
                _forget(platform)
    raise CameraUnavailable(f"no OpenGL without a display ({'; '.join(reasons)}); {_REMEDY}")


def _load(platform: str) -> Any:
    return importlib.import_module(f"mujoco.{platform}")


def _prove(context: Any) -> None:
    """Make a context current and the renderer in it once: some drivers give a context but none of its functions."""
    import mujoco

    try:
        context.make_current()
        empty = mujoco.MjModel.from_xml_string("<mujoco/>")
        mujoco.MjrContext(empty, mujoco.mjtFontScale.mjFONTSCALE_50).free()
    except Exception:
        context.free()
        raise


def _forget(platform: str) -> None:
    """Unload PyOpenGL and MuJoCo's binding to a platform that failed."""
    os.environ.pop(_PLATFORM_VARIABLE, None)
    prefixes = ("OpenGL", f"mujoco.{platform}")
    for name in [name for name in sys.modules if name.startswith(prefixes)]:
        del sys.modules[name]


def _short(error: Exception) -> str:
    if isinstance(error, AttributeError) and "NoneType" in str(error):
        return "library not found"
    text = " ".join(str(error).split())
    first = text.split(". ")[0].rstrip(".")
    return f"{type(error).__name__}: {first}" if first else type(error).__name__
