"""Removes one guard after the other from a copy of the packages; its tests must fail each time.

    python -m tests.mutation.run [--jobs N] [--markdown] [PATTERN]

The exit code is 1 if a guard survives, and 2 if a test fails without any mutation. Nothing is written into the
working tree.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

from tests.mutation.guards import ROOT, Guard, read_guards

#: What the tests need.
COPIED = ("allocation", "ibvs_qp", "sim", "tests", "pyproject.toml", "README.md")
#: A mutant may loop for ever: that is found as well, after this time [s].
PATIENCE_S = 300.0
#: Exit codes of pytest: tests failed, and all passed.
FAILED, PASSED = 1, 0
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


class Copy:
    """A copy of packages and tests in which one guard at a time is missing."""

    def __init__(self, folder: Path, machine_code: Path) -> None:
        self._folder = folder
        for name in COPIED:
            folder.mkdir(exist_ok=True)
            copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy2
            copy(ROOT / name, folder / name)  # with the times of change, so that compiled files stay valid
        self._environment = {
            **os.environ,
            "PYTHONPATH": str(folder),
            "PYTHONDONTWRITEBYTECODE": "1",  # that of a mutant would outlive it
            "IBVS_QP_CACHE": str(machine_code),
        }

    def run(self, tests: tuple[str, ...], patience_s: float | None = None) -> tuple[int, str]:
        """Exit code and output of pytest."""
        options = ["-q", "-x", "-n", "0", "-p", "no:cacheprovider", "--hypothesis-seed=0", "--tb=no"]
        command = [sys.executable, "-m", "pytest", *options, *tests]
        try:
            done = subprocess.run(
                command, cwd=self._folder, env=self._environment, capture_output=True, text=True, timeout=patience_s
            )
        except subprocess.TimeoutExpired:
            return FAILED, f"FAILED {tests[0].partition('::')[0]}::not_within_{patience_s:.0f}_s"
        return done.returncode, done.stdout + done.stderr

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
        failed = _FAILURE.search(output)
        seconds = time.monotonic() - begin
        if code == FAILED and failed is not None:
            return Result(guard, failed[1], "", seconds)
        return Result(guard, "", "" if code == PASSED else f"TROUBLE (pytest {code}): {output[-500:]}", seconds)


def results(guards: list[Guard], jobs: int) -> Iterator[Result]:
    """Results in the order of the guards.

    Raises:
        SystemExit: When one of the tests fails without any mutation.
    """
    with tempfile.TemporaryDirectory(prefix="mutation-") as scratch, ThreadPoolExecutor(jobs) as pool:
        copies: SimpleQueue[Copy] = SimpleQueue()
        for number in range(jobs):
            copies.put(Copy(Path(scratch) / str(number), Path(scratch) / "machine_code"))

        def without(guard: Guard) -> Result:
            copy = copies.get()
            try:
                return copy.without(guard)
            finally:
                copies.put(copy)

        whole = copies.get()
        code, output = whole.run(tuple(dict.fromkeys(test for guard in guards for test in guard.tests)))
        copies.put(whole)
        if code != PASSED:
            print(f"the tests fail without any mutation:\n{output[-3000:]}", file=sys.stderr)
            raise SystemExit(2)
        yield from pool.map(without, guards)


def markdown(found: list[Result]) -> str:
    """Table of guards, what they prevent and the tests that fail without them."""
    rows = ["| Part | Guard | Prevents | Test that fails without it |", "|---|---|---|---|"]
    for result in found:
        guard, test = result.guard, result.killed_by.rpartition("/")[2] or "**none**"
        rows.append(f"| {guard.part} | {guard.name} | {guard.prevents} | `{test}` |")
    killed = sum(bool(result.killed_by) for result in found)
    return "\n".join([f"{killed} of {len(found)} mutations are found.", "", *rows])


def main() -> int:
    """Run the guards that the command line chooses."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation.run", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("pattern", nargs="?", default="", help="part of 'part: name' of the guards to remove")
    parser.add_argument("--jobs", type=int, default=1, help="copies at work at the same time")
    parser.add_argument("--markdown", action="store_true", help="print a table for the documentation at the end")
    words = parser.parse_args()
    guards, found = read_guards(words.pattern), []
    for result in results(guards, words.jobs):
        print(result, file=sys.stderr if words.markdown else sys.stdout, flush=True)
        found.append(result)
    survivors = [result.guard.title for result in found if not result.killed_by]
    print(f"{len(found) - len(survivors)} of {len(found)} killed", file=sys.stderr)
    for title in survivors:
        print(f"not killed: {title}", file=sys.stderr)
    if words.markdown:
        print(markdown(found))
    return 1 if survivors or not found else 0


if __name__ == "__main__":
    sys.exit(main())
