"""Compiled code in the cache: only what this user compiled is loaded; a compiler has 10 s; nothing raises."""

from __future__ import annotations

import logging
import os
import shutil
import stat
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import pytest

from ibvs_qp.symbolic import machine_code as compiler_module
from ibvs_qp.symbolic.machine_code import machine_code

pytestmark = [
    pytest.mark.timeout(120),
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler on this machine"),
]
#: Writes a file when it is loaded.
PLANTED = """
#include <stdio.h>
__attribute__((constructor)) static void run(void) { fclose(fopen("%s", "w")); }
"""


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv("IBVS_QP_CACHE", str(folder))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(compiler_module, "PATIENCE_S", 300.0)  # on a busy machine
    monkeypatch.setattr(compiler_module, "_spent_s", 0.0)
    return folder


def small() -> ca.Function:
    x = ca.SX.sym("x", 2)
    return ca.Function("small", [x], [ca.sin(x[0]) * x[1] + x[0] / 3.0])


def planted(tmp_path: Path) -> bytes:
    """A library that leaves a trace when it is loaded."""
    (tmp_path / "planted.c").write_text(PLANTED % (tmp_path / "loaded"))
    subprocess.run(["cc", "-shared", "-fPIC", "-o", "planted.so", "planted.c"], cwd=tmp_path, check=True)
    return (tmp_path / "planted.so").read_bytes()


def cut(library: Path, tmp_path: Path) -> None:
    library.write_bytes(library.read_bytes()[:5000])


def flip(library: Path, tmp_path: Path) -> None:
    content = bytearray(library.read_bytes())
    content[len(content) // 2] ^= 1
    library.write_bytes(content)


def plant(library: Path, tmp_path: Path) -> None:
    library.write_bytes(planted(tmp_path))


def link(library: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere.so").write_bytes(library.read_bytes())
    (tmp_path / "elsewhere.so").chmod(0o700)
    library.unlink()
    library.symlink_to(tmp_path / "elsewhere.so")


def open_to_all(library: Path, tmp_path: Path) -> None:
    library.chmod(0o777)


def open_to_the_group(library: Path, tmp_path: Path) -> None:
    library.chmod(0o720)


def pipe(library: Path, tmp_path: Path) -> None:
    library.unlink()
    os.mkfifo(library, 0o700)


def give_away(library: Path, tmp_path: Path) -> None:
    if os.geteuid() != 0:
        pytest.skip("only root gives files away")
    os.chown(library, 65534, 65534)


@pytest.mark.parametrize("damage", [cut, flip, plant, link, open_to_all, open_to_the_group, pipe, give_away])
def test_a_library_that_is_not_what_was_compiled_is_compiled_anew(
    cache: Path,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    damage: Callable[[Path, Path], None],
) -> None:
    def load() -> bool:
        return machine_code(small()).class_name() == "External"

    assert load()
    (library,) = cache.glob("*.so")
    first, content = library.stat().st_ino, library.read_bytes()
    assert load() and library.stat().st_ino == first and not caplog.records
    replaced = library.with_name(library.name)
    copy = tmp_path / "copy"
    copy.write_bytes(content)
    library.unlink()  # the loaded file itself must not change
    shutil.copy(copy, replaced)
    replaced.chmod(0o700)
    damage(replaced, tmp_path)
    assert load()
    (again,) = cache.glob("*.so")
    assert again.read_bytes() == content and stat.S_IMODE(again.lstat().st_mode) == 0o700
    assert len(caplog.records) == 1 and "compiled anew" in caplog.text
    assert not (tmp_path / "loaded").exists()


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o1777])
def test_a_folder_that_others_can_write_is_not_used(cache: Path, caplog: pytest.LogCaptureFixture, mode: int) -> None:
    cache.mkdir()
    cache.chmod(mode)
    function = small()
    assert machine_code(function) is function and not list(cache.iterdir())
    assert len(caplog.records) == 1 and "writable by its owner only" in caplog.text


def test_a_folder_of_somebody_else_or_a_link_is_not_used(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "real").mkdir(mode=0o700)
    cache.symlink_to(tmp_path / "real")
    function = small()
    assert machine_code(function) is function
    cache.unlink()
    cache.mkdir(mode=0o700)
    assert machine_code(function) is not function
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    assert machine_code(function) is function


def test_the_folder_is_made_for_its_user_alone(cache: Path) -> None:
    before = os.umask(0o002)
    try:
        machine_code(small())
    finally:
        os.umask(before)
    (library,) = cache.iterdir()
    assert stat.S_IMODE(cache.stat().st_mode) == stat.S_IMODE(library.stat().st_mode) == 0o700


def test_a_hanging_compiler_has_its_time_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    hanging = tmp_path / "hanging"
    hanging.write_text("#!/bin/sh\nsleep 61\n")  # a child that holds what it inherits
    hanging.chmod(0o700)
    monkeypatch.setenv("CC", str(hanging))
    monkeypatch.setattr(compiler_module, "PATIENCE_S", 0.5)
    function, began = small(), time.monotonic()
    assert machine_code(function) is function and machine_code(function) is function
    assert time.monotonic() - began < 3.0
    assert len(caplog.records) == 2 and "hanging is given 0.5 s in all" in caplog.text
    sleeping = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True).stdout
    assert "sleep 61" not in sleeping.splitlines()


@pytest.mark.parametrize("command", ["cc '", 'cc "', "", "no-such-compiler", ".", "/dev/null", "false", "cc --no-such"])
def test_any_command_falls_back(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, command: str
) -> None:
    monkeypatch.setenv("CC", command)
    function = small()
    with caplog.at_level(logging.INFO):
        assert machine_code(function) is function
    assert caplog.records and not any("\n" in record.getMessage() for record in caplog.records)


def test_with_a_broken_command_a_flight_begins_in_a_new_process(tmp_path: Path) -> None:
    program = (
        "from ibvs_qp import ControllerConfig, HybridController; "
        "HybridController(ControllerConfig().on_backend('compiled')); print('ready')"
    )
    environment = {**os.environ, "CC": "cc '"}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stdout) == (0, "ready\n") and done.stderr.count("\n") == 1, done.stderr
