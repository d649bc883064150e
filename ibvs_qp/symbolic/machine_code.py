"""The compiled tick as machine code: CasADi writes C code, a C compiler, if there is one, translates it once.

CasADi evaluates a function instruction by instruction, about 7 ns each; a compiler's code takes a tenth of that and
gives the same bits (no contraction of products and sums, the same mathematical library). Without a
compiler, or after any failure, CasADi interprets the function.
"""

from __future__ import annotations

import logging
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np

from ibvs_qp.symbolic.compiler import compiler
from ibvs_qp.symbolic.shared_library import shared_library

#: How the code is translated: -O1 takes 1 s for a tick of 4000 instructions, and -O3 gives code no faster.
FLAGS = ("-O1", "-fPIC", "-shared", "-ffp-contract=off")
#: Random inputs on which the machine code must agree to the bit.
TRIALS = 8

log = logging.getLogger(__name__)


def machine_code(function: ca.Function) -> ca.Function:
    """The same function as machine code, or the function itself without a working compiler.

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
    return shared_library(function.name(), {f"{function.name()}.c": generator.dump()}, command, FLAGS)


def _agree(function: ca.Function, other: ca.Function) -> bool:
    random = np.random.default_rng(0)
    for _ in range(TRIALS):
        inputs = [random.uniform(-1.0, 1.0, function.numel_in(i)) for i in range(function.n_in())]
        pairs = zip(function.call(inputs), other.call(inputs), strict=True)
        if not all(np.array_equal(np.array(ours), np.array(theirs), equal_nan=True) for ours, theirs in pairs):
            return False
    return True
