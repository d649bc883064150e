"""A copy of packages and tests in which one guard at a time is missing, and pytest on it."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.mutation.guards import ROOT, Guard

#: What the tests need.
COPIED = ("allocation", "ibvs_qp", "sim", "tests", "pyproject.toml", "README.md")
#: Loaded once for all runs, each of which is a fork: they take 2 s, most tests less.
LOADED = ("casadi", "hypothesis", "numpy", "osqp", "scipy.sparse", "scipy.spatial.transform")
#: A mutant may loop for ever: that is found as well, after this time [s].
PATIENCE_S = 300.0
#: Exit codes of pytest: all passed, and tests failed.
PASSED, FAILED = 0, 1
_OPTIONS = ("-q", "-x", "-n", "0", "-p", "no:cacheprovider", "--hypothesis-seed=0", "--tb=no", "-W", "ignore")
_FAILURE = re.compile(r"^(?:FAILED|ERROR) (\S+?::\w+)", re.MULTILINE)


@dataclass(frozen=True)
class Result:
    """Of one mutation: the first test that failed, empty for none; or why nothing can be told."""

    guard: Guard
    killed_by: str
    trouble: str
    seconds: float

    def __str__(self) -> str:
        """One line."""
        told = f"killed    {self.killed_by}" if self.killed_by else self.trouble or "SURVIVED"
        return f"{self.seconds:5.1f} s  {self.guard.title:<70} {told}"


class WorkingCopy:
    """The copy.

    Args:
        folder: For the copy.
        machine_code: Cache of compiled ticks; copies may share it.
    """

    def __init__(self, folder: Path, machine_code: Path) -> None:
        self._folder, self._machine_code = folder, machine_code
        folder.mkdir()
        for name in COPIED:
            copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy2
            copy(ROOT / name, folder / name)  # with the times of change, so that compiled files stay valid
        for name in LOADED:
            importlib.import_module(name)

    def without(self, guard: Guard) -> Result:
        """Run the tests of a guard without it."""
        file, begin = self._folder / guard.file, time.monotonic()
        text, stat = file.read_text(encoding="utf-8"), file.stat()
        file.write_text(guard.mutated(text), encoding="utf-8")
        try:
            code, output = self.run(guard.tests, PATIENCE_S)
        finally:
            file.write_text(text, encoding="utf-8")
            os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))  # the compiled original counts again
        failed, seconds = _FAILURE.search(output), time.monotonic() - begin
        if code is None:
            return Result(guard, f"{guard.tests[0]}: not within {PATIENCE_S:.0f} s", "", seconds)
        if code == FAILED and failed is not None:
            return Result(guard, failed[1], "", seconds)
        return Result(guard, "", "" if code == PASSED else f"TROUBLE (pytest {code}): {output[-500:]}", seconds)

    def run(self, tests: tuple[str, ...], patience_s: float) -> tuple[int | None, str]:
        """Exit code of pytest, None if it was killed in the end, and its output."""
        with tempfile.TemporaryFile() as output:
            child = os.fork()
            if child == 0:
                self._test(tests, output.fileno())
            end, code = time.monotonic() + patience_s, None
            while code is None and time.monotonic() < end:
                found, status = os.waitpid(child, os.WNOHANG)
                code = os.waitstatus_to_exitcode(status) if found else None
                time.sleep(0.0 if found else 0.02)
            if code is None:
                os.killpg(child, signal.SIGKILL)
                os.waitpid(child, 0)
            output.seek(0)
            return code, output.read().decode(errors="replace")

    def _test(self, tests: tuple[str, ...], output: int) -> None:
        """In the child: forget what belongs to the working tree, and test."""
        code = -1
        try:
            os.setsid()
            os.dup2(output, 1)
            os.dup2(output, 2)
            os.chdir(self._folder)
            sys.dont_write_bytecode = True  # that of a mutant would outlive it
            changes = {"PYTHONPATH": str(self._folder), "IBVS_QP_CACHE": str(self._machine_code)}
            # The conftest of the copy leaves bytecode alone where a folder is set, though it is none.
            os.environ.update(changes, PYTHONDONTWRITEBYTECODE="1", PYTHONPYCACHEPREFIX="")
            sys.pycache_prefix = None
            sys.path[:] = [str(self._folder), *(path for path in sys.path if Path(path).resolve() != ROOT)]
            for name in [each for each in sys.modules if each.partition(".")[0] in COPIED]:
                del sys.modules[name]
            importlib.invalidate_caches()
            code = int(pytest.main([*_OPTIONS, *tests]))
        finally:
            sys.stdout.flush()
            os._exit(code & 0xFF)
