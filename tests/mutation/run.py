"""Removes one guard after the other from a copy of the packages; its tests must fail each time.

    python -m tests.mutation.run [--jobs N] [--markdown] [PATTERN]

The exit code is 1 if a guard survives, and 2 if a test fails without any mutation. Nothing is written into the
working tree.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from tests.mutation.guards import Guard, read_guards
from tests.mutation.working_copy import PASSED, Result, WorkingCopy

#: Time for all tests without a mutation [s].
ALL_TESTS_S = 1800.0
_copy: WorkingCopy


def _begin(scratch: str) -> None:
    """In a worker: its own copy."""
    global _copy
    folder = Path(scratch) / str(multiprocessing.current_process().pid)
    _copy = WorkingCopy(folder, Path(scratch) / "machine_code")


def _without(guard: Guard) -> Result:
    return _copy.without(guard)


def _unchanged(tests: tuple[str, ...]) -> tuple[int | None, str]:
    return _copy.run(tests, ALL_TESTS_S)


def results(guards: list[Guard], jobs: int) -> Iterator[Result]:
    """Results in the order of the guards.

    Raises:
        SystemExit: When one of the tests fails without any mutation.
    """
    context = multiprocessing.get_context("fork")
    with (
        tempfile.TemporaryDirectory(prefix="mutation-") as scratch,
        ProcessPoolExecutor(jobs, context, initializer=_begin, initargs=(scratch,)) as pool,
    ):
        tests = tuple(dict.fromkeys(test for guard in guards for test in guard.tests))
        for code, output in pool.map(_unchanged, [tests[start::jobs] for start in range(min(jobs, len(tests)))]):
            if code != PASSED:
                print(f"the tests fail without any mutation ({code}):\n{output[-3000:]}", file=sys.stderr)
                raise SystemExit(2)
        yield from pool.map(_without, guards)


def markdown(found: list[Result]) -> str:
    """Table of guards, what they prevent and the tests that fail without them."""
    rows = ["| Part | Guard | Without it | Test that fails |", "|---|---|---|---|"]
    for result in found:
        guard, test = result.guard, result.killed_by.rpartition("/")[2] or "**none**"
        rows.append(f"| {guard.part} | {guard.name} | {guard.prevents} | `{test}` |")
    killed = sum(bool(result.killed_by) for result in found)
    return "\n".join([f"{killed} of {len(found)} mutations are found.", "", *rows])


def main() -> int:
    """Run the guards that the command line chooses."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation.run", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("pattern", nargs="?", default="", help="part of 'part: name' of the guards to remove")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="one guard in N")
    parser.add_argument("--from", type=int, default=0, metavar="K", dest="first", help="the first of these")
    parser.add_argument("--jobs", type=int, default=1, help="copies at work at the same time")
    parser.add_argument("--markdown", action="store_true", help="print a table for the documentation at the end")
    words = parser.parse_args()
    found = []
    for result in results(read_guards(words.pattern)[words.first :: words.every], words.jobs):
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
