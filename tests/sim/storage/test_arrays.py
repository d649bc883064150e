"""npy and npz files of unknown origin: numbers and text of the size that the file has, or one refusal."""

from __future__ import annotations

import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hostile_files import NPY, header, npy, npz
from hypothesis import given, settings
from hypothesis import strategies as st

from ibvs_qp.config.files import UnreadableFile
from sim.storage.arrays import read_npy, read_npz

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
