"""One thread per process for linear algebra, as on the command line, and one compilation of vision for all workers."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # small matrices, and workers side by side

_COMPILE = "import ibvs_qp.vision.perception; from ibvs_qp.vision.compilation import prepare; prepare()"


def pytest_configure(config: pytest.Config) -> None:
    """Compile the kernels of vision before the workers start: each would do it for itself, in 25 s."""
    if not hasattr(config, "workerinput") and config.getoption("numprocesses", None):
        subprocess.run([sys.executable, "-c", _COMPILE], check=False, timeout=600, capture_output=True)
