"""Logs that are none: one line each, whatever is in them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from recorded_flights import record

from ibvs_qp.config.files import UnreadableFile
from ibvs_qp.recording import read_log, replay
from ibvs_qp.recording.header import digest

#: Place of the length of its records in an uncompressed chunk [bytes].
LENGTH_OF_RECORDS = 41


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    file = tmp_path_factory.mktemp("log") / "a.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("ibvs_qp.recording.writer.FLUSH_S", 0.0)  # chunks by ticks, whatever the machine's speed
        record(file, "rotor_loss", "controller", 300)
    return file.read_bytes()


def refused(file: Path, content: bytes) -> str:
    file.write_bytes(content)
    with pytest.raises(UnreadableFile) as caught:
        read_log(file)
    return caught.value.reason


def made(file: Path, facts: dict[str, str] | None, compression: CompressionType = CompressionType.NONE) -> bytes:
    """An MCAP file with a header and one message of another's."""
    with open(file, "wb") as stream:
        writer = Writer(stream, compression=compression)
        writer.start()
        if facts is not None:
            writer.add_metadata("ibvs_qp", facts)
        channel = writer.register_channel("/controller/input", "json", 0)
        writer.add_message(channel, 1, b"{}" * 100, 1)
        writer.finish()
    return file.read_bytes()


def header(**changes: str) -> dict[str, str]:
    facts = dict.fromkeys(("kind", "law", "safety", "rows"), "") | {"version": "1", "format": "1", "config": "a"}
    return facts | {"config_sha256": digest("a")} | changes


def test_what_is_no_log_is_refused_with_its_reason(tmp_path: Path, good: bytes) -> None:
    file = tmp_path / "x.mcap"
    assert refused(file, b"no log of a flight") == "it is no MCAP file"
    assert "no whole MCAP file" in refused(file, good[:30])
    assert "no log of ibvs_qp" in refused(file, made(file, None))
    assert "format '2'" in refused(file, made(file, header(format="2")))
    assert "header is damaged" in refused(file, made(file, header(config="b")))
    assert "header is damaged" in refused(file, made(file, {"format": "1"}))
    assert "no ticks" in refused(file, made(file, header()))
    assert "compressed (zstd)" in refused(file, made(file, header(), CompressionType.ZSTD))


def test_a_log_cut_anywhere_is_read_up_to_there_or_refused(tmp_path: Path, good: bytes) -> None:
    ticks = []
    for share in np.linspace(0.0, 1.0, 40):
        (tmp_path / "x.mcap").write_bytes(good[: int(share * len(good))])
        try:
            result = replay(read_log(tmp_path / "x.mcap"))
        except UnreadableFile:
            continue
        assert result.same and result.complete == (share == 1.0)
        ticks.append(result.ticks)
    assert ticks == sorted(ticks) and ticks[-1] == 300 and len(set(ticks)) > 20


def test_a_damaged_length_beyond_the_memory_ends_the_log_there(tmp_path: Path, good: bytes) -> None:
    file = tmp_path / "x.mcap"
    file.write_bytes(good)
    with open(file, "rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[100]
    assert not chunk.compression
    place = chunk.chunk_start_offset + LENGTH_OF_RECORDS
    assert int.from_bytes(good[place : place + 8], "little") == chunk.uncompressed_size
    file.write_bytes(good[:place] + (2**56).to_bytes(8, "little") + good[place + 8 :])
    result = replay(read_log(file))
    assert result.same and not result.complete and 50 < result.ticks < 150


@pytest.mark.parametrize("places", [15, pytest.param(60, marks=pytest.mark.slow)])
def test_flipped_bytes_are_found_or_harmless(tmp_path: Path, good: bytes, places: int) -> None:
    random = np.random.default_rng(2)
    file, seen = tmp_path / "x.mcap", set[str]()
    for place in random.integers(0, len(good), places):
        broken = bytearray(good)
        broken[place] ^= 1 << int(random.integers(8))
        file.write_bytes(broken)
        try:
            result: Any = replay(read_log(file))
        except UnreadableFile:
            seen.add("refused")
            continue
        assert result.same and result.ticks <= 300
        seen.add("whole" if result.ticks == 300 else "cut")
    assert seen >= {"cut", "whole"}
