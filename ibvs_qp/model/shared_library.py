"""C code as a shared library, translated once by the system's compiler and stored in the user's cache."""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

#: Longest time of a compiler run [s].
PATIENCE_S = 60.0


def cache_folder() -> Path:
    """Cache of machine code: ``IBVS_QP_CACHE``, else ``ibvs_qp`` in the user's cache folder."""
    own, base = os.environ.get("IBVS_QP_CACHE"), os.environ.get("XDG_CACHE_HOME")
    return Path(own) if own else (Path(base) if base else Path.home() / ".cache") / "ibvs_qp"


def compiler() -> list[str] | None:
    """The C compiler's command (``CC``, else cc), or None where there is none."""
    command = shlex.split(os.environ.get("CC", "cc"))
    return command if command and shutil.which(command[0]) else None


@functools.cache
def wide_registers() -> tuple[str, ...]:
    """The compiler's option for registers of 32 bytes where this machine has them: more at a time, the same bits."""
    try:
        known = Path("/proc/cpuinfo").read_text()
    except OSError:
        return ()  # another system: the compiler's own choice
    return ("-mavx2",) if platform.machine() == "x86_64" and " avx2 " in known else ()


def shared_library(name: str, code: str, command: list[str], flags: tuple[str, ...]) -> Path:
    """Shared library of some C code, from the cache if it was translated before.

    Args:
        name: First part of the file's name.
        code: The C code.
        command: The compiler's command, see `compiler`.
        flags: Its options.

    Raises:
        OSError: When the cache cannot be written or the compiler cannot be started.
        subprocess.SubprocessError: When the compiler fails or takes too long.
    """
    version = subprocess.run([*command, "--version"], capture_output=True, timeout=PATIENCE_S, check=True).stdout
    key = hashlib.sha256(b"\0".join((code.encode(), version, " ".join((*command, *flags)).encode()))).hexdigest()
    folder = cache_folder()
    library = folder / f"{name}-{key[:24]}.so"
    if library.exists():
        return library
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        source, made = Path(scratch) / f"{name}.c", Path(scratch) / f"{name}.so"
        source.write_text(code)
        build = [*command, *flags, "-o", str(made), str(source), "-lm"]
        subprocess.run(build, capture_output=True, timeout=PATIENCE_S, check=True)
        made.replace(library)  # at once: another process never loads half a file
    return library
