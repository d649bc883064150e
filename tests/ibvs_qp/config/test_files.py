"""The reader of files from outside, and TOML: bounded, regular files only, one sentence for every refusal."""

from __future__ import annotations

import contextlib
import os
import time
from pathlib import Path

import pytest
from hostile_files import BYTES, TOML, special_files
from hypothesis import given, settings
from hypothesis import strategies as st

from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import DEEPEST, LARGEST_TOML, UnreadableFile, parse_toml, read_bytes, read_toml
from ibvs_qp.config.settings import from_dict, load_toml
from ibvs_qp.pilot import PilotConfig

pytestmark = pytest.mark.timeout(60)


def test_a_regular_file_up_to_the_limit_is_read(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"12345")
    assert read_bytes(file, 5) == b"12345"
    with pytest.raises(UnreadableFile, match="has 5 bytes, at most 4"):
        read_bytes(file, 4)


def test_a_file_whose_size_the_system_does_not_tell_is_bounded(tmp_path: Path) -> None:
    file = Path("/proc/self/status")
    if not file.exists():
        pytest.skip("no /proc on this system")
    with pytest.raises(UnreadableFile, match="more than 10 bytes"):
        read_bytes(file, 10)


@pytest.mark.timeout(20)
@pytest.mark.parametrize("kind", ["device", "terminal", "pipe", "socket", "folder", "loop", "missing", "huge"])
def test_special_files_are_refused_at_once(tmp_path: Path, kind: str) -> None:
    began = time.monotonic()
    with pytest.raises(UnreadableFile) as caught:
        read_bytes(special_files(tmp_path, ".toml")[kind], 1000)
    assert str(tmp_path / kind) in str(caught.value) and caught.value.reason
    assert time.monotonic() - began < 1.0


def test_what_the_system_refuses_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError(13, "Permission denied")

    with pytest.raises(UnreadableFile, match=r"null byte|null character"):
        read_bytes("a\0b", 10)
    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(UnreadableFile, match="Permission denied"):
        read_bytes(tmp_path, 10)


@pytest.mark.timeout(20)
@pytest.mark.parametrize("kind", [ControllerConfig, PilotConfig])
@pytest.mark.parametrize("name", [*TOML, *BYTES])
def test_hostile_toml_is_refused_in_a_short_line(tmp_path: Path, kind: type, name: str) -> None:
    file = tmp_path / "x.toml"
    file.write_bytes(BYTES[name] if name in BYTES else TOML[name].encode())
    with pytest.raises(ConfigError) as caught:
        load_toml(kind, file)
    text = str(caught.value)
    assert str(file) in text and "\n" not in text and len(text) < 1500


def test_size_depth_and_integers_have_limits(tmp_path: Path) -> None:
    file = tmp_path / "x.toml"
    file.write_bytes(b"#" * (LARGEST_TOML + 1))
    with pytest.raises(ConfigError, match="at most"):
        read_toml(file)
    for open_, close in (("[", "]"), ("{a = ", "}")):
        inner = "[]" if open_ == "[" else "1"
        assert parse_toml("a = " + open_ * (DEEPEST - 2) + inner + close * (DEEPEST - 2), "x")
        with pytest.raises(ConfigError, match=f"more than {DEEPEST} levels"):
            parse_toml("a = " + open_ * (DEEPEST + 1) + inner + close * (DEEPEST + 1), "x")
    assert parse_toml(".".join("a" * DEEPEST) + " = 1", "x")
    assert parse_toml(f"a = {2**63 - 1}\nb = {-(2**63)}", "x") == {"a": 2**63 - 1, "b": -(2**63)}
    for number in (2**63, -(2**63) - 1, 10**5000):
        with pytest.raises(ConfigError, match="64 bits"):
            parse_toml(f"a = [[0x{number:x}]]" if number > 0 else f"a = {number}", "x")


@pytest.mark.parametrize("text", ['"' * 10**6, '"\\"' * 300_000, ',"\\",' * 200_000, "a " * 500_000, " ." * 500_000])
def test_the_search_for_deep_keys_is_linear(text: str) -> None:
    began = time.monotonic()
    with pytest.raises(ConfigError):
        parse_toml(text, "x")
    assert time.monotonic() - began < 5.0


def test_integers_beyond_every_float_are_refused_without_a_file_too() -> None:
    for value in (10**400, 10**5000):
        with pytest.raises(ConfigError, match=r"gains\.line_kp"):
            from_dict(ControllerConfig, {"gains": {"line_kp": value}})
        with pytest.raises(ConfigError, match="line_slots"):
            ControllerConfig(line_slots=value)


_VALUES = st.recursive(
    st.one_of(st.integers(), st.floats(), st.text(max_size=5), st.booleans(), st.datetimes()),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(["controller", "painting", "vision", "camera", "law", "x"]), st.data())
def test_any_table_becomes_a_preset_or_one_line(section: str, data: st.DataObject) -> None:
    default = PilotConfig()
    inner = getattr(default, section, None)
    names = st.sampled_from(list(vars(inner))) if hasattr(inner, "__dict__") else st.text(max_size=5)
    value = data.draw(_VALUES | st.dictionaries(names, _VALUES, max_size=3))
    with contextlib.suppress(ConfigError):
        from_dict(PilotConfig, {section: value})


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=200))
def test_any_bytes_are_toml_or_one_line(content: bytes) -> None:
    try:
        assert isinstance(parse_toml(content, "x"), dict)
    except ConfigError as error:
        assert str(error).startswith("x is ")


def test_a_mark_of_a_windows_editor_is_no_part_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_bytes(b"\xef\xbb\xbf[controller]\r\ntick_s = 0.002\r\n")
    assert PilotConfig.from_toml(tmp_path / "mine.toml").controller.tick_s == 0.002
