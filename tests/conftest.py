"""One thread per process for linear algebra, as on the command line, and one compilation for all workers."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # small matrices, and workers side by side

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # of a shell's background job; processes of tests inherit it
    with contextlib.suppress(ValueError):  # in another thread
        signal.signal(signal.SIGINT, signal.default_int_handler)

if sys.dont_write_bytecode and "PYTHONPYCACHEPREFIX" not in os.environ:  # every child would compile all sources anew
    sys.dont_write_bytecode, sys.pycache_prefix = False, str(Path(__file__).parents[1] / ".pytest_cache" / "bytecode")
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

_COMPILE = "import ibvs_qp.vision.perception; from ibvs_qp.vision.compilation import prepare; prepare()"


def pytest_configure(config: pytest.Config) -> None:
    """Compile the kernels of vision before the workers start: each would do it for itself, in 25 s."""
    if not hasattr(config, "workerinput") and config.getoption("numprocesses", None):
        with contextlib.suppress(subprocess.TimeoutExpired):  # the tests compile then
            subprocess.run([sys.executable, "-c", _COMPILE], check=False, timeout=600, capture_output=True)
