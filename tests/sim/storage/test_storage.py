"""Files of unknown origin are read within their size, or refused once; a folder has one holder of its lock."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tracemalloc
import zipfile
from pathlib import Path

import file_fuzz
import numpy as np
import pytest
from file_fuzz import EDITS, TOMLS, VALUES
from hostile_files import NPY, header, npy, npz
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.config.files import UnreadableFile
from sim.commands.cli import main
from sim.storage.arrays import read_npy, read_npz
from sim.storage.folder import locked_folder
from sim.storage.parquet import refuse_what_aborts
from sim.sweep.parts import frame, read_tables, write_table

ARRAYS = {
    "law/t": np.linspace(0.0, 1.0, 50),
    "law/point": np.asfortranarray(np.arange(12.0).reshape(3, 4)).astype(np.float32),
    "law/flag": np.array([True, False]),
    "law/text": np.array([["phase", "é"]]),
    "law/one": np.array(3),
    "law/none": np.zeros((0, 6)),
    "law/empty": np.array(""),
}
LARGEST = 1 << 20


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_what_numpy_wrote_reads_back_equal_and_writable(tmp_path: Path, save) -> None:
    save(tmp_path / "x.npz", **ARRAYS)
    found = read_npz(tmp_path / "x.npz", LARGEST, LARGEST)
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert found[name].dtype == array.dtype and found[name].flags.writeable
        np.testing.assert_array_equal(found[name], array)
        np.save(tmp_path / "x.npy", array)
        np.testing.assert_array_equal(read_npy(tmp_path / "x.npy", LARGEST), array)


@pytest.mark.parametrize("name", NPY)
def test_headers_that_lie_allocate_nothing(tmp_path: Path, name: str) -> None:
    (tmp_path / "x.npy").write_bytes(NPY[name])
    (tmp_path / "x.npz").write_bytes(npz({"a.npy": NPY[name]}))
    with pytest.raises(UnreadableFile, match="no npy file of plain arrays"):
        read_npy(tmp_path / "x.npy", LARGEST)
    with pytest.raises(UnreadableFile, match="no npz file of plain arrays"):
        read_npz(tmp_path / "x.npz", LARGEST, LARGEST)


def test_a_lying_header_costs_no_memory(tmp_path: Path) -> None:
    (tmp_path / "x.npy").write_bytes(npy(header((2**25,)), bytes(80)))
    tracemalloc.start()
    with pytest.raises(UnreadableFile, match="needs more bytes than the file has"):
        read_npy(tmp_path / "x.npy", LARGEST)
    assert tracemalloc.get_traced_memory()[1] < 2 * LARGEST
    tracemalloc.stop()


def test_an_archive_that_unpacks_to_more_than_its_limit(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "x.npz", **{f"a{n}": np.zeros(LARGEST // 80) for n in range(11)})
    assert (tmp_path / "x.npz").stat().st_size < LARGEST // 50
    with pytest.raises(UnreadableFile, match="at most 1048576"):
        read_npz(tmp_path / "x.npz", LARGEST, LARGEST)


def test_an_archive_that_lies_about_the_size_of_a_member(tmp_path: Path) -> None:
    content = npz({"a.npy": bytes(100_000)}).replace((100_000).to_bytes(4, "little"), (100).to_bytes(4, "little"))
    (tmp_path / "x.npz").write_bytes(content)
    with pytest.raises(UnreadableFile):
        read_npz(tmp_path / "x.npz", LARGEST, LARGEST)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), min_size=1, max_size=8), st.booleans())
def test_any_damage_is_refused_or_harmless(tmp_path_factory: pytest.TempPathFactory, damage, compressed: bool) -> None:
    file = tmp_path_factory.mktemp("x") / "x.npz"
    (np.savez_compressed if compressed else np.savez)(file, **ARRAYS)
    content = bytearray(file.read_bytes())
    for place, value in damage:
        content[place % len(content)] = value
    file.write_bytes(content)
    try:
        found = read_npz(file, LARGEST, LARGEST)
    except UnreadableFile:
        return
    assert zipfile.is_zipfile(file) and sum(array.nbytes for array in found.values()) < LARGEST


pytestmark = pytest.mark.timeout(300)
BOUNDED = settings(max_examples=30, deadline=None, suppress_health_check=list(HealthCheck))


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> file_fuzz.Runs:
    return file_fuzz.Runs(tmp_path_factory.mktemp("runs"))


@BOUNDED
@given(st.sampled_from(list(TOMLS)), EDITS)
def test_toml_with_edits(tmp_path: Path, kind: type | None, edits: file_fuzz.Edits) -> None:
    file_fuzz.check_toml(tmp_path, kind, file_fuzz.edited(TOMLS[kind].encode(), edits))


@BOUNDED
@given(st.sampled_from(list(TOMLS)), VALUES)
def test_toml_with_other_values(tmp_path: Path, kind: type | None, values: list[tuple[int, str]]) -> None:
    file_fuzz.check_toml(tmp_path, kind, file_fuzz.with_values(TOMLS[kind], values).encode())


@BOUNDED
@given(st.sampled_from(["log.npz", "scene.toml"]), EDITS)
def test_logs_with_edits(tmp_path: Path, runs: file_fuzz.Runs, name: str, edits: file_fuzz.Edits) -> None:
    runs.check_edited(tmp_path, runs.flown, name, edits)


@pytest.mark.slow
@BOUNDED
@given(st.data())
def test_logs_with_other_arrays(tmp_path: Path, runs: file_fuzz.Runs, data: st.DataObject) -> None:
    runs.check_arrays(tmp_path, data)


@BOUNDED
@given(st.sampled_from(["qp.rows", "qp.jsonl"]), EDITS)
def test_journals_with_edits(tmp_path: Path, runs: file_fuzz.Runs, name: str, edits: file_fuzz.Edits) -> None:
    runs.check_edited(tmp_path, runs.killed, f"partial-1/{name}", edits)


@BOUNDED
@given(EDITS)
def test_summaries_with_edits(tmp_path: Path, runs: file_fuzz.Runs, edits: file_fuzz.Edits) -> None:
    runs.check_summary(tmp_path, edits)


@settings(BOUNDED, max_examples=5)  # each starts two processes
@given(EDITS)
def test_tables_with_edits(tmp_path: Path, runs: file_fuzz.Runs, edits: file_fuzz.Edits) -> None:
    runs.check_table(tmp_path, edits)


@BOUNDED
@given(st.sampled_from(["manifest.csv", "color.png", "depth.png"]), EDITS)
def test_frames_with_edits(tmp_path: Path, runs: file_fuzz.Runs, name: str, edits: file_fuzz.Edits) -> None:
    runs.check_frames(tmp_path, name, edits)


def test_a_folder_has_one_holder_at_a_time(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with locked_folder(folder):
        with pytest.raises(IbvsQpError, match="in use by another process"), locked_folder(folder):
            pass
        (folder / "file").write_text("")
    with locked_folder(folder):
        assert (folder / "file").exists()


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
