"""C code as a shared library, compiled once, stored in the user's cache, and verified before it is loaded.

A library is code that runs with the user's rights, so the cache is trusted no further than its owner, permissions and
content tell: the file's name ends in the hash of its content.
"""

from __future__ import annotations

import hashlib
import logging
import os
import stat
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.config.files import read_bytes
from ibvs_qp.symbolic.compiler import compiler_version, run_compiler

#: Digits of the hashes in a file's name: 96 bit each.
_DIGITS = 24
#: Largest library that is loaded [bytes]: a tick has 0.3 MB.
_LARGEST = 64 << 20

log = logging.getLogger(__name__)


def cache_folder() -> Path:
    """Cache of machine code: ``IBVS_QP_CACHE``, else ``ibvs_qp`` in the user's cache folder."""
    own, base = os.environ.get("IBVS_QP_CACHE"), os.environ.get("XDG_CACHE_HOME")
    return Path(own) if own else (Path(base) if base else Path.home() / ".cache") / "ibvs_qp"


def shared_library(name: str, sources: Mapping[str, str], command: list[str], flags: tuple[str, ...]) -> Path:
    """Shared library of some C code, from the cache if it was compiled before and is what was compiled.

    Args:
        name: First part of the file's name.
        sources: C files and headers by name, all compiled together.
        command: The compiler's command, see `ibvs_qp.symbolic.compiler`.
        flags: Its options.

    Raises:
        OSError: When the cache cannot be written or others can write it, or the compiler cannot be started or takes
            too long.
        subprocess.SubprocessError: When the compiler fails.
    """
    words = " ".join((*command, *flags)).encode()
    content = "\0".join((*sources, *sources.values())).encode()
    key = _hash(b"\0".join((content, compiler_version(*command), words)))
    folder = cache_folder()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not _only_ours(folder, stat.S_ISDIR):
        raise PermissionError(f"{folder} must belong to this user and be writable by its owner only (chmod go-w)")
    for library in folder.glob(f"{name}-{key}-*.so"):
        if _intact(library):
            return library
        log.warning("%s is not what was compiled, or others can write it: compiled anew", library)
        library.unlink()
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        made = Path(scratch) / f"{name}.so"
        for file, code in sources.items():
            (Path(scratch) / file).write_text(code)
        units = sorted(str(Path(scratch) / file) for file in sources if file.endswith(".c"))
        run_compiler([*command, *flags, f"-I{scratch}", "-o", str(made), *units, "-lm"])
        made.chmod(0o700)
        library = folder / f"{name}-{key}-{_hash(made.read_bytes())}.so"
        made.replace(library)  # at once: another process never loads half a file
    return library


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:_DIGITS]


def _intact(library: Path) -> bool:
    """Whether a file is this user's alone and has the content that its name tells."""
    try:
        return _only_ours(library, stat.S_ISREG) and library.stem.endswith("-" + _hash(read_bytes(library, _LARGEST)))
    except (IbvsQpError, OSError):
        return False


def _only_ours(path: Path, is_kind: Callable[[int], bool]) -> bool:
    """Whether a path is no link, of a kind, owned by this user, and writable by its owner only."""
    found = path.lstat()
    return is_kind(found.st_mode) and found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
