"""Rows of a flight are on the disk as soon as they are appended."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from sim.flight.journal import Header, Journal


def test_a_chunk_is_on_the_disk_at_once(tmp_path: Path) -> None:
    header = Header(law="qp", seed=3, scene="", preset="", columns={"t": 1, "tip": 3}, program=2)
    journal = Journal(tmp_path / "partial", header)
    rows, notes = tmp_path / "partial" / "qp.rows", tmp_path / "partial" / "qp.jsonl"
    assert json.loads(notes.read_text())["seed"] == 3
    for count in (1, 2):
        journal.append([np.arange(4.0)] * 25, [np.ones(2)] * 25, {"ticks": 25})
        assert rows.stat().st_size == count * 25 * header.row.itemsize
        assert len(notes.read_text().splitlines()) == 1 + count
    found = np.fromfile(rows, header.row)
    assert (found["log"] == np.arange(4.0)).all() and (found["program"] == 1.0).all()
    journal.close()
