"""Every command on every kind of hostile file: exit code 2, one line on standard error, nothing flown."""

from __future__ import annotations

import io
import itertools
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from contract_schema import refusal
from hostile_files import BYTES, JSON, NPY, TOML, npz, special_files
from synthetic_trace import synthetic_trace

import sim.flight.side_by_side
import sim.storage.parquet
import sim.sweep.flying
import sim.sweep.parts
from ibvs_qp.config.files import UnreadableFile
from ibvs_qp.pilot.presets import FOLDER
from sim.commands.cli import main
from sim.flight.flight_log import load_run, save_log

pytestmark = pytest.mark.timeout(120)
SPECIAL = ("device", "terminal", "pipe", "socket", "folder", "loop", "missing", "huge")
QP = str(FOLDER / "tarot_t960_qp.toml")
CAMERA = "--fx 600 --fy 600 --cx 320 --cy 240".split()
#: Commands that read TOML; the file takes the place of FILE.
TOML_COMMANDS = (
    "paint --scene FILE",
    "paint --preset FILE",
    "paint --world FILE",
    f"compare FILE {QP}",
    f"compare {QP} FILE",
    "experiment approach --quick --world FILE",
    "sweep FILE",
    "tune --preset FILE",
    "vehicle FILE",
    "bridge --dry-run --config FILE",
    "bridge --dry-run --vehicle FILE",
    "detect bag --topics FILE",
)
#: Commands that read other kinds.
COMMANDS = (
    *TOML_COMMANDS,
    "tune --storage FILE",
    "sweep --report FILE",
    f"detect --rgb FILE {' '.join(CAMERA)}",
    f"detect --rgb color.png --depth FILE {' '.join(CAMERA)}",
    "detect --sequence FILE",
    "detect FILE",
    "explain FILE --at 1",
    "replay FILE",
    "compare FILE FILE",
)


@pytest.fixture(autouse=True)
def nothing_flies(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def fly(*_: object, **__: object) -> None:
        raise AssertionError("a flight began")

    monkeypatch.setattr(sim.flight.side_by_side, "fly", fly)
    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def refuses(capfd: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Runs a command that must end with exit code 2 and one short line on standard error."""

    def run(words: str, file: Path | str = "") -> str:
        return refusal([str(file) if word == "FILE" else word for word in words.split()], capfd)

    return run


@pytest.mark.parametrize(
    ("command", "kind"),
    [each for each in itertools.product(COMMANDS, SPECIAL) if each != ("tune --storage FILE", "missing")],  # a new one
)
def test_special_files(tmp_path: Path, refuses: Callable[..., str], command: str, kind: str) -> None:
    import cv2

    cv2.imwrite("color.png", np.zeros((8, 8, 3), np.uint8))
    file = special_files(tmp_path, ".toml" if command in TOML_COMMANDS else ".x")[kind]
    assert kind in refuses(command, file)


@pytest.mark.parametrize("name", BYTES)
def test_mcap(refuses: Callable[..., str], name: str) -> None:
    """More of them: tests/ibvs_qp/interfaces/log/test_reader.py."""
    Path("x.mcap").write_bytes(BYTES[name])
    assert "x.mcap: it is no MCAP file" in refuses("replay x.mcap")


@pytest.mark.parametrize("name", [*TOML, *BYTES])
@pytest.mark.parametrize("command", TOML_COMMANDS)
def test_toml(refuses: Callable[..., str], command: str, name: str) -> None:
    Path("x.toml").write_bytes(BYTES[name] if name in BYTES else TOML[name].encode())
    assert "x.toml" in refuses(command, "x.toml")


@pytest.mark.parametrize(
    "values", ["[nan]", "[inf, 1.0]", "{low = nan, high = 1.0, steps = 3}", "{low = 0, high = inf}"]
)
@pytest.mark.parametrize("section", ["grid", "random", "fixed"])
def test_values_of_a_sweep_that_are_not_finite(refuses: Callable[..., str], section: str, values: str) -> None:
    samples = "samples = 3\n" if section == "random" else ""
    Path("x.toml").write_text(f'{samples}[{section}]\n"scene.wall.friction" = {values}\n')
    refuses("sweep x.toml")


@pytest.mark.parametrize("name", [*JSON, *BYTES])
@pytest.mark.parametrize("command", ["compare a b"])
def test_json(refuses: Callable[..., str], command: str, name: str) -> None:
    for folder in ("a", "b"):
        Path(folder).mkdir()
        Path(folder, "summary.json").write_bytes(BYTES[name] if name in BYTES else JSON[name].encode())
    refuses(command)


def tables() -> dict[str, bytes]:
    """Parquet files that are no tables of flights."""
    flights = {"experiment": "x", "law": "qp", "variant": "run", "seed": 1, "completed": True, "reason": ""}
    made = {
        "other columns": {"a": [1]},
        "seed is text": {name: ["1"] if name == "seed" else [value] for name, value in flights.items()},
        "completed is a list": {name: [[True]] if name == "completed" else [v] for name, v in flights.items()},
        "figure is a list": {**{name: [value] for name, value in flights.items()}, "force_rms_n": [[1.0]]},
    }
    found = {}
    for name, columns in made.items():
        pl.DataFrame(columns).write_parquet(stream := io.BytesIO())
        found[name] = stream.getvalue()
    return found


def test_parquet(
    refuses: Callable[..., str], capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # none of these ends the process; that is tested in tests/sim/storage/test_storage.py
    monkeypatch.setattr(sim.sweep.parts, "refuse_what_aborts", lambda files: None)
    table = pl.read_parquet(FOLDER.parents[2] / "docs" / "experiments" / "fair.parquet").head(40)
    table.write_parquet(stream := io.BytesIO())
    good = stream.getvalue()
    random = np.random.default_rng(3)
    cases = {"empty": b"", "text": b"PAR1" * 100, "cut": good[:5000], "no end": good[:-4], "no start": good[500:]}
    for place in random.integers(len(good) - 3000, len(good) - 8, 60):  # the footer: some of these make Polars panic
        broken = bytearray(good)
        broken[place] ^= 0xFF
        cases[f"byte {place}"] = bytes(broken)
    Path("a").mkdir()
    for name, content in {**cases, **tables(), **BYTES}.items():
        Path("a/all.parquet").write_bytes(content)
        if name.startswith("byte"):  # it may hit a figure's statistics, which nobody reads
            assert main(["compare", "a", "a", "--json"]) in (0, 2)
            assert capfd.readouterr().err.count("\n") <= 1
            continue
        refuses("compare a a")
        refuses("sweep --report a")


def test_a_table_of_few_bytes_and_many_cells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pl.select(pl.repeat(1.0, 100_000).alias("a")).write_parquet(tmp_path / "all.parquet")
    monkeypatch.setattr(sim.storage.parquet, "MOST_CELLS", 99_999)
    with pytest.raises(UnreadableFile, match="100000 cells"):
        sim.storage.parquet.read_parquet(tmp_path / "all.parquet")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a made-up flight under the QP law with everything that `explain` prints but a program."""
    folder = tmp_path_factory.mktemp("log")
    from ibvs_qp.config.settings import dump_toml
    from ibvs_qp.pilot import PilotConfig

    trace = synthetic_trace(law="qp")
    count = len(trace.t)
    trace.arrays |= {"program": np.zeros((count, 7), np.float32), "reach_margin": np.zeros(count)}
    trace.preset = PilotConfig().to_toml()
    (folder / "scene.toml").write_text(dump_toml(trace.scene))
    save_log(folder / "log.npz", {"qp": trace})
    return folder


def test_logs_that_are_no_logs(log: Path, refuses: Callable[..., str]) -> None:
    shutil.copy(log / "scene.toml", ".")
    good = (log / "log.npz").read_bytes()
    cut = {f"cut at {share}": good[: int(share * len(good))] for share in (0.01, 0.5, 0.99)}
    headers = {name: npz({"qp/t.npy": content}) for name, content in NPY.items()}
    others = {"no archive": b"x", "empty": b"", "archive of nothing": npz({}), "archive of text": npz({"a": b"b"})}
    for content in {**cut, **headers, **others, **BYTES}.values():
        Path("log.npz").write_bytes(content)
        assert "log.npz" in refuses("explain . --at 1") or content == others["archive of nothing"]


@pytest.mark.parametrize(
    ("name", "array"),
    [
        ("t", None),
        ("t", np.zeros(3)),
        ("t", np.array(1.0)),
        ("t", np.full(100, np.nan)),
        ("thrusts", np.zeros((3, 6))),
        ("thrusts", None),
        ("phase", np.full(100, 99)),
        ("outcome", np.full(100, -1)),
        ("phases", None),
        ("events", None),
        ("event_t", np.zeros(2)),
        ("event_text", np.array(["a"])),
        ("event_text", np.array(["\ud800", "x"])),
        ("outcome_of_flight", np.array(["True"])),
        ("seed", np.array([1, 2])),
        ("seed", np.array(np.nan)),
        ("seed", np.array("one")),
        ("limits", np.array(["a"] * 50)),
        ("program", np.full((100, 7), np.nan)),
        ("push_true", np.array(["a"] * 100)),
        ("preset", np.array("[[[")),
        ("preset", np.array("a = " + "[" * 5000)),
        ("preset", np.array("law = 'best'")),
        ("preset", np.array(3.0)),
    ],
)
def test_logs_with_a_wrong_array(log: Path, refuses: Callable[..., str], name: str, array: np.ndarray | None) -> None:
    with np.load(log / "log.npz") as stored:
        arrays = {key: stored[key] for key in stored.files}
    whole = arrays.pop(f"qp/{name}", None)
    if array is not None:
        fits = array.shape[:1] == (100,) and whole is not None
        arrays[f"qp/{name}"] = np.repeat(array[:1], len(whole), 0) if fits and whole is not None else array
    np.savez(Path("log.npz"), **arrays)
    shutil.copy(log / "scene.toml", ".")
    refuses("explain . --at 1")


@pytest.mark.parametrize("name", [*TOML, *BYTES])
def test_a_broken_scene_of_a_log(log: Path, refuses: Callable[..., str], name: str) -> None:
    shutil.copy(log / "log.npz", ".")
    Path("scene.toml").write_bytes(BYTES[name] if name in BYTES else TOML[name].encode())
    assert "scene.toml" in refuses("explain . --at 1")


def test_the_untouched_log_reads(log: Path) -> None:
    assert len(load_run(log)["qp"].t) > 100
