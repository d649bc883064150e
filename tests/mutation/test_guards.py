"""The list of guards is up to date: each one is in its file once, and its tests exist; a mutation changes a copy."""

from __future__ import annotations

import ast
import functools
import os
import subprocess
import sys
import zlib

import pytest

from tests.mutation.guards import ROOT, Guard, read_guards

GUARDS = read_guards()
EVERY = int(os.environ.get("IBVS_QP_GUARDS", "1"))
#: Mutations that no test found before there was this list.
ONCE_SURVIVORS = {
    "thrusts: rate damping's sign in the hover",
    "inputs: plane bound 0.05 to 0 per metre",
    "thrusts: non-finite states moving on",
    "clock: pictures from the future",
    "inputs: specific-force bound of the sensor gate",
    "clock: lead of 20 ms to 1 s",
    "thrusts: clip without lower bound",
}


@functools.cache
def functions(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def test_the_list_is_long_enough_and_has_no_guard_twice() -> None:
    titles = [guard.title for guard in GUARDS]
    assert len(titles) == len(set(titles)) >= 60
    assert set(titles) >= ONCE_SURVIVORS
    assert len({(guard.file, guard.original, guard.mutant) for guard in GUARDS}) == len(titles)


@pytest.mark.parametrize("guard", GUARDS, ids=lambda guard: guard.title)
def test_every_guard_is_in_its_file_once_and_its_tests_exist(guard: Guard) -> None:
    text = (ROOT / guard.file).read_text(encoding="utf-8")
    mutant = guard.mutated(text)
    assert mutant != text
    compile(mutant, guard.file, "exec")
    assert guard.tests and guard.prevents
    for test in guard.tests:
        file, _, name = test.partition("::")
        assert not name or name.partition("[")[0] in functions(file), test


def removed(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tests.mutation.run", *words]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


def test_a_mutation_changes_a_copy_alone() -> None:
    (guard,) = read_guards("supervisor: latch")
    before = (ROOT / guard.file).stat()
    done = removed(guard.title)
    assert done.returncode == 0 and "::test_from_a_retreat_on_nothing_leads_back" in done.stdout, done.stderr
    after = (ROOT / guard.file).stat()
    assert (after.st_mtime_ns, after.st_ino) == (before.st_mtime_ns, before.st_ino)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_no_guard_survives() -> None:
    """One guard in IBVS_QP_GUARDS; which ones depends on the revision, so that revisions take turns."""
    revision = b""
    if EVERY > 1:
        revision = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True).stdout
    first = zlib.crc32(revision) % EVERY
    done = removed("--jobs", "2", "--every", str(EVERY), "--from", str(first))
    assert done.returncode == 0, done.stderr
