"""The compiled tick as machine code: CasADi writes it down as C, a C compiler that is there translates it once.

CasADi evaluates a function instruction by instruction, about 7 ns each; a compiler's code takes a tenth of that and
gives the same bits (no contraction of products and sums, the same mathematical library). Where there is no compiler,
or anything goes wrong, the function itself serves.
"""

from __future__ import annotations

import hashlib
import logging
import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

import casadi as ca
import numpy as np

#: How the code is translated: -O1 takes 1 s for a tick of 4000 instructions, and -O3 gives code no faster.
FLAGS = ("-O1", "-fPIC", "-shared", "-ffp-contract=off")
#: A compiler that takes longer is given up [s].
PATIENCE_S = 60.0
#: Random inputs on which the machine code must agree to the bit before it is believed.
TRIALS = 8

log = logging.getLogger(__name__)


def cache_folder() -> Path:
    """Where machine code is kept between runs: ``IBVS_QP_CACHE``, else ``ibvs_qp`` in the user's cache folder."""
    own, base = os.environ.get("IBVS_QP_CACHE"), os.environ.get("XDG_CACHE_HOME")
    return Path(own) if own else (Path(base) if base else Path.home() / ".cache") / "ibvs_qp"


def compiler() -> list[str] | None:
    """The C compiler's command (``CC``, else cc), or None where there is none."""
    command = shlex.split(os.environ.get("CC", "cc"))
    return command if command and shutil.which(command[0]) else None


def machine_code(function: ca.Function) -> ca.Function:
    """The same function as machine code, the function itself where that cannot be had.

    Args:
        function: Any function of numbers; its name must be a C identifier.

    Returns:
        A function with the same name, inputs and outputs, whose results agree to the bit.

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
    code = generator.dump()
    version = subprocess.run([*command, "--version"], capture_output=True, timeout=PATIENCE_S, check=True).stdout
    key = hashlib.sha256(b"\0".join((code.encode(), version, " ".join((*command, *FLAGS)).encode()))).hexdigest()
    folder = cache_folder()
    library = folder / f"{function.name()}-{key[:24]}.so"
    if library.exists():
        return library
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        source, made = Path(scratch) / "tick.c", Path(scratch) / "tick.so"
        source.write_text(code)
        build = [*command, *FLAGS, "-o", str(made), str(source), "-lm"]
        subprocess.run(build, capture_output=True, timeout=PATIENCE_S, check=True)
        made.replace(library)  # at once: another process never loads half a file
    return library


def _agree(function: ca.Function, other: ca.Function) -> bool:
    random = np.random.default_rng(0)
    for _ in range(TRIALS):
        inputs = [random.uniform(-1.0, 1.0, function.numel_in(i)) for i in range(function.n_in())]
        pairs = zip(function.call(inputs), other.call(inputs), strict=True)
        if not all(np.array_equal(np.array(ours), np.array(theirs), equal_nan=True) for ours, theirs in pairs):
            return False
    return True
