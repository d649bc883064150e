"""Bags of the public repository ros2/rosbag2, its tests' resources: read with the counts of mcap and sqlite3."""

from __future__ import annotations

import os
import sqlite3
from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from mcap.reader import NonSeekingReader

from ibvs_qp.interfaces.ros.recording import Recording

FOLDER = Path(os.environ.get("IBVS_QP_ROSBAG2", "/no such folder"))
FILES = sorted(file for end in ("mcap", "db3") for file in FOLDER.glob(f"*/**/resources/**/*.{end}"))


def counted(file: Path) -> Counter[str]:
    """Messages by topic, by the libraries of the formats."""
    if file.suffix == ".mcap":
        with open(file, "rb") as stream:
            return Counter(channel.topic for _, channel, _ in NonSeekingReader(stream).iter_messages())
    with sqlite3.connect(f"file:{file}?mode=ro", uri=True) as database:
        return Counter(
            dict(
                database.execute(
                    "SELECT name, COUNT(*) FROM messages m, topics t WHERE t.id = m.topic_id GROUP BY name"
                )
            )
        )


def read(path: Path) -> tuple[Counter[str], list[str]]:
    recording = Recording(path)
    try:
        topics = {channel.topic for channel in recording.channels}
        counts = Counter(each.channel.topic for each in recording.messages(topics))
    finally:
        recording.close()
    return counts, recording.differences


@pytest.mark.skipif(not FILES, reason="IBVS_QP_ROSBAG2 names no checkout of ros2/rosbag2, whose bags are not committed")
def test_every_file_and_every_folder_has_its_own_counts() -> None:
    assert len(FILES) >= 30
    for file in FILES:
        assert read(file) == (counted(file), []), file
    for folder in sorted({file.parent for file in FILES}):
        whole: Counter[str] = sum((counted(file) for file in FILES if file.parent == folder), Counter())
        assert read(folder)[0] == whole, folder
