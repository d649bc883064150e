"""Damaged files for the fuzz tests: valid ones with edits, and what every reader must do with them."""

from __future__ import annotations

import contextlib
import io
import json
import math
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.config.settings import load_toml
from ibvs_qp.pilot import PilotConfig
from sim.commands.cli import main
from sim.flight.flight_log import load_run
from sim.sweep.spec import load_spec
from sim.world.errors import WorldErrors
from sim.world.scene import Scene

ROOT = Path(__file__).parents[2]
#: Pieces that parsers and programs stumble over.
TOKENS = [
    *"nan inf -inf 1e400 -1e308 1e-320 -0.0 0 -1 9223372036854775807 9223372036854775808 0x7fffffffffffffff".split(),
    *"true [] {} '' [[]] [1,2,3,4,5,6,7] {a=1} \"\\u0000\" 1979-05-27 [x] [[x]] a.b=1 # = , \" ''' \"\"\" \\".split(),
    "9" * 400, "[" * 40, "{a=" * 40, "a." * 40 + "a=1", "\n", "\r", "\0", "\ufeff", "\ud7ff", "é" * 50, "x" * 300,
]  # fmt: skip
#: One edit of a file: where (fraction), bytes removed, bytes put there.
_EDIT = st.tuples(
    st.floats(0.0, 1.0),
    st.integers(0, 8),
    st.sampled_from([token.encode() for token in TOKENS]) | st.binary(max_size=4),
)
EDITS = st.lists(_EDIT, min_size=1, max_size=4)
#: One value replaced: index of the line with a value, and the new value.
VALUES = st.lists(st.tuples(st.integers(0, 10_000), st.sampled_from(TOKENS)), min_size=1, max_size=3)
TOML_FILES = {
    PilotConfig: ROOT / "ibvs_qp" / "presets" / "tarot_t960_qp.toml",
    Scene: ROOT / "sim" / "scenes" / "default.toml",
    WorldErrors: ROOT / "sim" / "world" / "profiles" / "harsh.toml",
    None: ROOT / "sim" / "sweep" / "specs" / "robustness.toml",
}


def edited(content: bytes, edits: list[tuple[float, int, bytes]]) -> bytes:
    """The content with edits."""
    for where, removed, put in edits:
        place = min(int(where * len(content)), len(content))
        content = content[:place] + put + content[place + removed :]
    return content


def with_values(text: str, values: list[tuple[int, str]]) -> str:
    """TOML with other values."""
    lines = text.split("\n")
    settable = [index for index, line in enumerate(lines) if "=" in line and not line.startswith("#")]
    for number, value in values:
        index = settable[number % len(settable)]
        lines[index] = f"{lines[index].partition('=')[0]}= {value}"
    return "\n".join(lines)


def check_toml(folder: Path, kind: type | None, content: bytes) -> None:
    """It is read, or refused in a sentence that names the file."""
    file = folder / "x.toml"
    file.write_bytes(content)
    try:
        load_spec(file) if kind is None else load_toml(kind, file)
    except IbvsQpError as error:
        assert "x.toml" in str(error) and len(str(error)) < 20_000


def run(words: list[str]) -> Any:
    """The JSON of a command, or None after one line with exit code 2."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main([*words, "--json"])
    assert code in (0, 2), err.getvalue()
    if code == 2:
        assert out.getvalue() == "" and err.getvalue().count("\n") == 1, err.getvalue()
        return None
    return json.loads(out.getvalue())


def check_log(folder: Path, at: float) -> None:
    """`load_run` reads the folder or refuses it, and `explain` ends with JSON or one line."""
    try:
        traces = load_run(folder)
    except IbvsQpError as error:
        assert str(folder) in str(error) and "\n" not in str(error)
        traces = {}
    for trace in traces.values():
        assert all(math.isfinite(t) for t in trace.t)
    run(["explain", str(folder), "--at", str(at)])
