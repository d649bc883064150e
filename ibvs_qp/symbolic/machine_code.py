"""CasADi functions and C code as machine code: compiled once, stored in the user's cache, verified before it is loaded.

CasADi evaluates a function instruction by instruction, about 7 ns each; a compiler's code takes a tenth of that and
gives the same bits (no contraction of products and sums, the same mathematical library). Without a
compiler, or after any failure, CasADi interprets the function.

A library is code that runs with the user's rights, so its owner, permissions and content are checked
before it is loaded: the file's name ends in the hash of its content.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import shlex
import shutil
import signal
import stat
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import casadi as ca
import numpy as np

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.config.files import read_bytes

#: How a function is translated: -O1 takes 1 s for a tick of 4000 instructions, and -O3 gives code no faster.
FLAGS = ("-O1", "-fPIC", "-shared", "-ffp-contract=off")
#: Random inputs on which the machine code must be bit-identical.
TRIALS = 8
#: Time that compilers may take in one process [s], all runs together: a tick and its solver need 4 s on an idle core.
PATIENCE_S = 30.0
#: Digits of the hashes in a file's name: 96 bit each.
_DIGITS = 24
#: Largest library that is loaded [bytes]: a tick has 0.3 MB.
_LARGEST = 64 << 20

log = logging.getLogger(__name__)
_spent_s = 0.0


def machine_code(function: ca.Function) -> ca.Function:
    """The same function as machine code, or the function itself without a working compiler.

    Args:
        function: Any function of numbers; its name must be a C identifier.

    Returns:
        A function with the same name, inputs and outputs, whose results are bit-identical.

    Source: CasADi user guide, section 5.2 (generated code and ``external``).
    """
    command = compiler()
    if command is None:
        log.info("no C compiler: %s is interpreted", function.name())
        return function
    try:
        found = ca.external(function.name(), str(_library(function, command)))
    except (OSError, RuntimeError, subprocess.SubprocessError) as error:
        log.warning("%s is interpreted: %s", function.name(), error)
        return function
    if not _agree(function, found):
        log.warning("%s is interpreted: the machine code of %s gives other numbers", function.name(), command[0])
        return function
    return found


def _library(function: ca.Function, command: list[str]) -> Path:
    """Shared library of the function, from the cache if it was translated before."""
    generator = ca.CodeGenerator(function.name())
    generator.add(function)
    return shared_library(function.name(), {f"{function.name()}.c": generator.dump()}, command, FLAGS)


def _agree(function: ca.Function, other: ca.Function) -> bool:
    random = np.random.default_rng(0)
    for _ in range(TRIALS):
        inputs = [random.uniform(-1.0, 1.0, function.numel_in(i)) for i in range(function.n_in())]
        pairs = zip(function.call(inputs), other.call(inputs), strict=True)
        if not all(np.array_equal(np.array(ours), np.array(theirs), equal_nan=True) for ours, theirs in pairs):
            return False
    return True


def cache_folder() -> Path:
    """Cache of machine code: ``IBVS_QP_CACHE``, else ``ibvs_qp`` in the user's cache folder."""
    own, base = os.environ.get("IBVS_QP_CACHE"), os.environ.get("XDG_CACHE_HOME")
    return Path(own) if own else (Path(base) if base else Path.home() / ".cache") / "ibvs_qp"


def shared_library(name: str, sources: Mapping[str, str], command: list[str], flags: tuple[str, ...]) -> Path:
    """Shared library of some C code, from the cache if it was compiled before and is unchanged.

    Args:
        name: First part of the file's name.
        sources: C files and headers by name, all compiled together.
        command: The compiler's command, see `ibvs_qp.symbolic.machine_code`.
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
        log.warning("%s has changed since it was compiled, or others can write it: compiled anew", library)
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
    """Whether a file is this user's alone and has the content of the hash in its name."""
    try:
        return _only_ours(library, stat.S_ISREG) and library.stem.endswith("-" + _hash(read_bytes(library, _LARGEST)))
    except (IbvsQpError, OSError):
        return False


def _only_ours(path: Path, is_kind: Callable[[int], bool]) -> bool:
    """Whether a path is no link, of a kind, owned by this user, and writable by its owner only."""
    found = path.lstat()
    return is_kind(found.st_mode) and found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def compiler() -> list[str] | None:
    """The C compiler's command (``CC``, else cc), or None without a compiler."""
    command = list(_words(os.environ.get("CC", "cc")))
    return command if os.name == "posix" and command and shutil.which(command[0]) else None


@functools.cache  # an invalid command is reported once, however many functions are translated
def _words(given: str) -> tuple[str, ...]:
    try:
        return tuple(shlex.split(given))
    except ValueError as error:
        log.warning("CC = %r is no command: %s", given, error)
        return ()


@functools.cache
def compiler_version(*command: str) -> bytes:
    """Version string of a compiler; raises as `run_compiler`."""
    return run_compiler([*command, "--version"])


def run_compiler(command: list[str]) -> bytes:
    """Standard output of one run.

    Raises:
        OSError: When it cannot be started, or the time of this process is used up: it and its children are killed.
        subprocess.SubprocessError: When it fails.
    """
    global _spent_s
    began = time.monotonic()
    # A file, not a pipe: a pipe stays open as long as any child of a killed compiler lives.
    with tempfile.TemporaryFile() as output:
        # The command is the user's own CC, split into words, without a shell.
        process = subprocess.Popen(  # nosec B603
            command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.DEVNULL, start_new_session=True
        )
        try:
            code = process.wait(max(PATIENCE_S - _spent_s, 0.0))
        except subprocess.TimeoutExpired:
            raise TimeoutError(f"{command[0]} is given {PATIENCE_S:g} s in all") from None
        finally:
            if process.returncode is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            _spent_s += time.monotonic() - began
        if code:
            raise subprocess.CalledProcessError(code, command)
        output.seek(0)
        return output.read()
