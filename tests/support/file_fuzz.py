"""Damaged files for the fuzz tests: valid ones with edits, and what every reader must do with them."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from hypothesis import strategies as st

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.config.settings import dump_toml, load_toml
from ibvs_qp.pilot import PilotConfig
from sim.commands.cli import main
from sim.detection.manifest import COLUMNS
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.flight_log import load_run
from sim.flight.options import FlightOptions
from sim.report.rundir import RunFolder
from sim.sweep.parts import frame, write_table
from sim.sweep.spec import load_spec
from sim.world.errors import WorldErrors
from sim.world.scene import Scene
from tests.support.truth import FAMILIES, render_frame, sample_scene

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
Edits = list[tuple[float, int, bytes]]
EDITS = st.lists(_EDIT, min_size=1, max_size=4)
#: Length of the flight whose log is damaged [s].
FLIGHT_S = 0.9
FIGURES = {"force_rms_n": 0.1, "path_rms_m": 0.002}
#: One value replaced: index of the line with a value, and the new value.
VALUES = st.lists(st.tuples(st.integers(0, 10_000), st.sampled_from(TOKENS)), min_size=1, max_size=3)
#: Valid TOML with every key of its kind; None is a sweep.
TOMLS: dict[type | None, str] = {
    PilotConfig: dump_toml(PilotConfig()),
    Scene: dump_toml(Scene()),
    WorldErrors: dump_toml(WorldErrors()),
    None: (ROOT / "sim" / "sweep" / "specs" / "robustness.toml").read_text(),
}


def edited(content: bytes, edits: Edits) -> bytes:
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
        found = load_spec(file).setups["qp"] if kind is None else load_toml(kind, file)
    except IbvsQpError as error:
        assert "x.toml" in str(error) and len(str(error)) < 20_000
        return
    assert all_finite(found)


def all_finite(value: Any) -> bool:
    """Whether every number of a settings tree is."""
    if dataclasses.is_dataclass(value):
        return all(all_finite(getattr(value, field.name)) for field in dataclasses.fields(value))
    if isinstance(value, tuple):
        return all(map(all_finite, value))
    return not isinstance(value, float) or math.isfinite(value)


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


class Runs:
    """A run of a short flight, the same as a killed process leaves it, a table and a frame, as origins of damaged ones.

    Args:
        folder: Folder of the originals.
    """

    def __init__(self, folder: Path) -> None:
        self.flown, self.killed = folder / "flown", folder / "killed"
        journal = self.killed / "partial-1"
        options = FlightOptions(features="geometric", video=False, journal=str(journal))

        def stop(flown_s: float, *_: object) -> None:
            if flown_s > FLIGHT_S:
                raise KeyboardInterrupt

        trace = fly(Scene(), options, stop)
        run = RunFolder(self.flown)
        table = {"seed": 0, "laws": {"qp": compute_metrics(trace)}, "version": "1", "command": "none"}
        run.write_record({"qp": trace}, table)
        rows = [
            {"experiment": "x", "law": "qp", "variant": "run", "seed": seed, "completed": True, "reason": "", **FIGURES}
            for seed in range(20)
        ]
        write_table(self.flown / "x.parquet", frame(rows))
        truth = render_frame(sample_scene(FAMILIES["near wall"], 1))
        self.frame = folder / "frame"
        self.frame.mkdir()
        step, units = 4, 5000.0
        color, depth = truth.frame.rgb[::step, ::step], truth.frame.depth[::step, ::step]
        cv2.imwrite(str(self.frame / "color.png"), color[..., ::-1])
        cv2.imwrite(str(self.frame / "depth.png"), np.rint(depth * units).astype(np.uint16))
        numbers = (*(value / step for value in truth.frame.intrinsics), units, *(value / step for value in truth.seed))
        lines = (",".join(COLUMNS), ",".join(("color.png", "depth.png", *map(str, numbers))))
        (self.frame / "manifest.csv").write_text("\n".join(lines) + "\n")

    def check_edited(self, folder: Path, origin: Path, name: str, edits: Edits) -> None:
        """A log with edits in one of its files: `load_run` and `explain` read or refuse it."""
        _copy(origin, folder)
        (folder / name).write_bytes(edited((origin / name).read_bytes(), edits))
        check_log(folder)

    def check_arrays(self, folder: Path, data: st.DataObject) -> None:
        """A log with other values, shapes or types in some arrays."""
        _copy(self.flown, folder)
        with np.load(self.flown / "log.npz") as log:
            arrays = {name: log[name] for name in log.files}
        for name in data.draw(st.lists(st.sampled_from(sorted(arrays)), min_size=1, max_size=3, unique=True)):
            arrays[name] = data.draw(_OTHERS)(arrays[name])
        np.savez(folder / "log.npz", **{name: array for name, array in arrays.items() if array is not None})
        check_log(folder)

    def check_summary(self, folder: Path, edits: Edits) -> None:
        """`compare` of a summary with edits."""
        (folder / "summary.json").write_bytes(edited((self.flown / "summary.json").read_bytes(), edits))
        run(["compare", str(folder), str(self.flown)])
        (folder / "summary.json").unlink()

    def check_table(self, folder: Path, edits: Edits) -> None:
        """`compare` of a table with edits."""
        (folder / "x.parquet").write_bytes(edited((self.flown / "x.parquet").read_bytes(), edits))
        run(["compare", str(folder), str(folder)])

    def check_frames(self, folder: Path, name: str, edits: Edits) -> None:
        """`detect` of a folder with edits in one file."""
        _copy(self.frame, folder)
        (folder / name).write_bytes(edited((self.frame / name).read_bytes(), edits))
        run(["detect", "--sequence", str(folder), "--all"])


def _copy(origin: Path, folder: Path) -> None:
    shutil.copytree(origin, folder, dirs_exist_ok=True)


def _repeated(array: np.ndarray) -> np.ndarray:
    return np.concatenate([array, array]) if array.ndim else np.array([array, array])


def _extreme(value: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(array: np.ndarray) -> np.ndarray:
        if array.dtype.kind not in "fiu" or not array.size:
            return array
        changed = array.astype(float if array.dtype.kind != "f" else array.dtype)
        with np.errstate(over="ignore"):
            changed.flat[:: max(changed.size // 7, 1)] = value
        return changed

    return change


#: Other arrays in the place of one; None leaves it out.
_OTHERS = st.sampled_from(
    [
        *(_extreme(value) for value in (math.nan, math.inf, -math.inf, 1e308, -1e38, -1.0, 0.0, 1e18)),
        _repeated,
        lambda array: None,
        lambda array: array[:0] if array.ndim else array,
        lambda array: array[:-1] if array.ndim else array,
        lambda array: array.reshape(-1),
        lambda array: array.reshape(1, *array.shape),
        lambda array: array.astype(str),
        lambda array: np.array(["\ud800"] * len(array)) if array.ndim else np.array("\ud800"),
        lambda array: np.array("a = " + "[" * 5000),
        lambda array: np.zeros_like(array),
    ]
)


def check_log(folder: Path) -> None:
    """`load_run` reads the folder or refuses it, and `explain` ends with JSON or one line."""
    at = 0.5
    try:
        traces = load_run(folder)
    except IbvsQpError as error:
        assert str(folder) in str(error)
    else:
        at = next((float(trace.t[len(trace.t) // 2]) for trace in traces.values() if len(trace.t)), at)
    run(["explain", str(folder), "--at", str(at)])
