"""The run folder: log, scene, presets, summary, figures, video and report of a run."""

from __future__ import annotations

import contextlib
import json
import math
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.config.settings import dump_toml
from sim.flight.closed_loop import MCAP
from sim.flight.flight_log import write_log
from sim.flight.side_by_side import Flight, own_peak_memory
from sim.flight.trace import FIELDS, Trace
from sim.flight.unfinished import JOURNALS
from sim.storage.atomic import replaced, replacing, write_text
from sim.storage.folder import locked_folder

SCHEMA = 1
#: Files of a run besides its figures, and those that only `paint` writes.
_FILES = ("report.html", "summary.json", "video.mp4", "scene.toml", "log.npz", "README.txt")
_RECORD = ("log.npz", "summary.json")
_README = """One run of ibvs-qp.

report.html   all results on one page; open it in a browser (it plays video.mp4 of the folder, and needs nothing else)
summary.json  all figures (docs/metrics.md of the project defines them)
figures/      the report's figures as PNG
video.mp4     the vehicle from outside, camera view, phase and push (H.264)
scene.toml    the scene; command of the flight: {command}
preset_*.toml configuration of the pilot under each law
flight_*.mcap log for Foxglove and Rerun, with --log mcap; check it with: ibvs-qp replay flight_qp.mcap
log.npz       every array, named <law>/<array>; load it with

    import numpy as np
    log = np.load("log.npz")
    t, push = log["qp/t"], log["qp/push_true"]
    phase = log["qp/phases"][log["qp/phase"]]   # name of the phase at every tick

  or as traces, ready for sim.evaluate.metrics and sim.figures, with

    from sim.flight.flight_log import load_run
    traces = load_run("{path}")
    traces["qp"].push_true

  N control ticks, M physics steps at 1 kHz, F pictures, n rotors, L limits; SI units:

{fields}
"""


@dataclass(frozen=True)
class RunFolder:
    """Paths of one run."""

    path: Path
    journal: Path | None = None  # folder of the rows that reach the disk in flight
    before: frozenset[tuple[Path, int]] = frozenset()  # files of an earlier run, with their inodes

    @property
    def report(self) -> Path:
        """The HTML report."""
        return self.path / "report.html"

    @classmethod
    @contextlib.contextmanager
    def open(cls, out: Path | None, *, resume: bool = False, overwrite: bool = False) -> Iterator[RunFolder]:
        """Create the folder, ``runs/<UTC stamp>`` by default, and hold it for this process.

        Args:
            out: The folder, or None.
            resume: Whether the command continues the run in the folder; only a run of `paint` is then refused.
            overwrite: Whether a run in it may be replaced.

        Yields:
            The folder; it is removed at the end if it is empty.

        Raises:
            IbvsQpError: If it cannot be written, is in use, or is not empty.
        """
        path = _stamped(Path("runs")) if out is None else out
        with locked_folder(path):
            used = any((path / name).exists() for name in _RECORD) if resume else any(path.iterdir())
            if used and not overwrite:
                advice = "it has the run of a flight" if resume else "--overwrite replaces a run in it"
                raise IbvsQpError(f"run folder {path} is not empty: {advice}; give another folder with --out")
            before = frozenset((file, file.stat().st_ino) for file in _own_files(path))
            yield cls(path, _stamped(path, JOURNALS), before)

    def write_record(self, traces: dict[str, Trace], summary_table: dict[str, Any]) -> None:
        """Write log, scene, presets, summary and README before anything that could fail.

        Each replaces that of an earlier run in the same folder when it is complete; the journals are then superfluous.
        """
        with replacing(self.path / "log.npz") as stream:
            write_log(stream, traces)  # a full disk is noticed here, before another file is replaced
            for law, trace in traces.items():
                write_text(self.path / "scene.toml", dump_toml(trace.scene))
                write_text(self.path / f"preset_{law}.toml", trace.preset)
        fields = "\n".join(f"  {name:<20} {text}" for name, text in FIELDS.items())
        command = summary_table["command"]
        write_text(self.path / "README.txt", _README.format(command=command, path=self.path, fields=fields))
        self.write_summary(summary_table)
        for law in traces:
            if self.journal is not None and (made := self.journal / f"{law}{MCAP}").exists():
                made.replace(self.path / f"flight_{law}{MCAP}")
        for folder in self.path.glob(f"{JOURNALS}*"):
            shutil.rmtree(folder, ignore_errors=True)

    def logs(self) -> list[Path]:
        """MCAP logs of the run."""
        return sorted(self.path.glob(f"flight_*{MCAP}"))

    def write_summary(self, summary_table: dict[str, Any]) -> None:
        """Write summary.json."""
        write_json(self.path / "summary.json", summary_table)

    def write_report(self, traces: dict[str, Trace], summary_table: dict[str, Any], video: bool) -> None:
        """Draw the figures, the video and the report."""
        from sim.figures import draw_all
        from sim.report.report import write_report
        from sim.video.film import write_video

        flown = {law: trace for law, trace in traces.items() if len(trace.t)}
        figures = draw_all(flown, self.path / "figures") if flown else {}
        film = None
        if video and flown:
            with replaced(film := self.path / "video.mp4") as partial:
                write_video(flown, partial)
        write_report(self.report, flown, summary_table, figures, film)

    def remove_stale(self) -> None:
        """Remove the rest of an earlier run in the same folder: files that this run did not replace."""
        for file, inode in self.before:
            if file.exists() and file.stat().st_ino == inode:
                file.unlink()


def _own_files(path: Path) -> list[Path]:
    """Files that a run wrote into a folder."""
    found = [*(path / name for name in _FILES), *path.glob("preset_*.toml"), *path.glob("figures/*.png")]
    found += path.glob(f"flight_*{MCAP}")
    return [file for file in found if file.exists()]


def _stamped(parent: Path, prefix: str = "") -> Path:
    stamp = prefix + datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    path, number = parent / stamp, 1
    while path.exists():
        number += 1
        path = parent / f"{stamp}-{number}"
    return path


def summary(
    facts: dict[str, Any],
    folder: RunFolder,
    metrics: dict[str, dict[str, Any]],
    interrupted: bool,
    wall_time_s: float,
    peak_memory_bytes: int,
) -> dict[str, Any]:
    """Content of summary.json.

    Args:
        facts: command, seed, scene, world, preset, camera, image_size, features, vision; classes of the user's.
        folder: The run folder.
        metrics: M of every law flown.
        interrupted: Whether Ctrl-C ended the run.
        wall_time_s: Time since the start of the command [s].
        peak_memory_bytes: Of all processes together.
    """
    return {
        "schema": SCHEMA,
        "command": facts["command"],
        "version": version("ibvs-qp"),
        **{key: facts[key] for key in ("seed", "scene", "world", "preset")},
        "run_dir": str(folder.path),
        **{key: facts[key] for key in ("camera", "image_size", "features", "vision")},
        **{key: facts[key] for key in ("strategy", "controller", "rows") if key in facts},
        "interrupted": interrupted,
        "wall_time_s": wall_time_s,
        "peak_memory_bytes": peak_memory_bytes,
        "laws": metrics,
    }


def peak_memory(flights: Iterable[Flight]) -> int:
    """Peak resident memory of this process plus the peaks of the flight processes [bytes], an upper bound."""
    return own_peak_memory() + sum(flight.process_memory_bytes for flight in flights)


def as_json(value: Any, indent: int | None = None) -> str:
    """JSON text; non-finite numbers become null."""
    return json.dumps(_finite(value), indent=indent, allow_nan=False)


def write_json(file: Path, value: Any) -> None:
    """Write a readable JSON file, with line breaks; non-finite numbers become null."""
    write_text(file, as_json(value, indent=1) + "\n")


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
