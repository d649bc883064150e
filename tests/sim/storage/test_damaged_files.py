"""Valid files with edits, a bounded number; tests/fuzz goes on with the same checks."""

from __future__ import annotations

from pathlib import Path

import file_fuzz
import pytest
from file_fuzz import EDITS, TOMLS, VALUES
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

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
