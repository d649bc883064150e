"""Damaged files by the thousand: TOML, logs, journals, summaries, tables, frames; run by ``pytest -m slow``.

``IBVS_QP_FUZZ_FILES`` is the number of files of each kind; of tables, which start two processes each, a fortieth.
"""

from __future__ import annotations

import os
from pathlib import Path

import file_fuzz
import pytest
from file_fuzz import EDITS, TOMLS, VALUES
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

FILES = int(os.environ.get("IBVS_QP_FUZZ_FILES", "4000"))


def examples(count: int) -> settings:
    return settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> file_fuzz.Runs:
    return file_fuzz.Runs(tmp_path_factory.mktemp("runs"))


@examples(FILES)
@given(st.sampled_from(list(TOMLS)), EDITS, VALUES)
def test_toml(tmp_path: Path, kind: type | None, edits: file_fuzz.Edits, values: list[tuple[int, str]]) -> None:
    text = TOMLS[kind]
    file_fuzz.check_toml(tmp_path, kind, file_fuzz.with_values(text, values).encode())
    file_fuzz.check_toml(tmp_path, kind, file_fuzz.edited(text.encode(), edits))


@examples(FILES)
@given(st.sampled_from(["log.npz", "scene.toml"]), EDITS, st.data())
def test_logs(tmp_path: Path, runs: file_fuzz.Runs, name: str, edits: file_fuzz.Edits, data: st.DataObject) -> None:
    runs.check_edited(tmp_path, runs.flown, name, edits)
    runs.check_arrays(tmp_path, data)


@examples(FILES)
@given(st.sampled_from(["qp.rows", "qp.jsonl"]), EDITS)
def test_journals(tmp_path: Path, runs: file_fuzz.Runs, name: str, edits: file_fuzz.Edits) -> None:
    runs.check_edited(tmp_path, runs.killed, f"partial-1/{name}", edits)


@examples(FILES)
@given(EDITS)
def test_summaries(tmp_path: Path, runs: file_fuzz.Runs, edits: file_fuzz.Edits) -> None:
    runs.check_summary(tmp_path, edits)


@examples(FILES // 40)  # each starts two processes
@given(EDITS)
def test_tables(tmp_path: Path, runs: file_fuzz.Runs, edits: file_fuzz.Edits) -> None:
    runs.check_table(tmp_path, edits)


@examples(FILES)
@given(st.sampled_from(["manifest.csv", "color.png", "depth.png"]), EDITS)
def test_frames(tmp_path: Path, runs: file_fuzz.Runs, name: str, edits: file_fuzz.Edits) -> None:
    runs.check_frames(tmp_path, name, edits)
