"""Damaged Parquet ends the process that decodes it, and not ours."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ibvs_qp.config.files import UnreadableFile
from sim.commands.cli import main
from sim.storage.parquet import refuse_what_aborts
from sim.sweep.parts import frame, write_table
from sim.sweep.tables import read_tables

#: A table of flights with one byte changed: the length of a page is 2^61.
DAMAGED = Path(__file__).with_name("aborts_polars.parquet")


def test_the_damaged_file_aborts_polars() -> None:
    """Where it no longer does, the process of its own may go."""
    code = f"import polars; polars.read_parquet({str(DAMAGED)!r})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode < 0 and "memory allocation" in done.stderr


def test_it_is_refused_and_whole_files_are_read(tmp_path: Path) -> None:
    whole = tmp_path / "whole.parquet"
    row = {"experiment": "x", "law": "qp", "variant": "run", "seed": 1, "completed": True, "reason": "", "tilt": 0.5}
    write_table(whole, frame([row]))
    with pytest.raises(UnreadableFile, match=r"aborts_polars\.parquet: no Parquet table"):
        read_tables([whole, DAMAGED, whole], foreign=True)
    assert read_tables([whole, whole], foreign=True)["tilt"].to_list() == [0.5, 0.5]


def test_compare_says_so_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(DAMAGED, tmp_path / "x.parquet")
    assert main(["compare", str(tmp_path), str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_decoder_imports_nothing_from_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_table(whole := tmp_path / "whole.parquet", frame([{"experiment": "x", "seed": 1}]))
    (tmp_path / "polars.py").write_text("raise SystemExit(3)\n")
    monkeypatch.chdir(tmp_path)
    refuse_what_aborts([whole])


def test_an_error_of_the_decoder_is_not_one_of_the_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sim.storage.parquet._DECODE", "import nothing_of_this_name")
    with pytest.raises(RuntimeError, match="nothing_of_this_name"):
        refuse_what_aborts([DAMAGED])
