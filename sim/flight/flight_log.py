"""log.npz of a run: every array of every law, written and read back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ibvs_qp.config.files import UnreadableFile
from sim.flight.trace import PAINTED, Event, Trace
from sim.flight.unfinished import check_arrays, unfinished_run
from sim.storage.arrays import read_npz
from sim.storage.atomic import replacing
from sim.storage.limits import LARGEST_ARRAYS, LARGEST_LOG
from sim.world.scene import Scene, load_scene
from sim.world.worlds import world_name


def save_log(file: Path, traces: dict[str, Trace]) -> None:
    """Write a log, complete or not at all.

    Raises:
        UnwritableFile: When the disk is full or the file cannot be written.
    """
    with replacing(file) as stream:
        write_log(stream, traces)


def write_log(stream: BinaryIO, traces: dict[str, Trace]) -> None:
    """Write every array of every law in npz format, named ``<law>/<array>``."""
    content: dict[str, Any] = {}
    for law, trace in traces.items():
        arrays = trace.arrays | facts_of(trace)
        if trace.canvas is not None and trace.coverage_mask is not None:
            arrays["canvas"] = trace.canvas
        content.update({f"{law}/{name}": values for name, values in arrays.items()})
    np.savez_compressed(stream, **content)


def facts_of(trace: Trace) -> dict[str, Any]:
    """Contents of a log in addition to the arrays of a trace and its canvas, as arrays."""
    facts: dict[str, Any] = {name: np.array(getattr(trace, name), str) for name in ("phases", "outcomes", "limits")}
    facts["event_t"] = np.array([event.t for event in trace.events])
    facts["event_text"] = np.array([[event.kind, event.text] for event in trace.events], dtype=str)
    if trace.coverage_mask is not None:
        painted = trace.coverage_mask > PAINTED  # rounding must not move a pixel across the bound
        percent, bound = np.round(100 * trace.coverage_mask), 100 * PAINTED
        percent = np.where(painted, np.maximum(percent, bound + 1), np.minimum(percent, bound))
        facts["coverage_percent"] = percent.astype(np.uint8)
        facts["canvas_px_per_m"] = np.array(trace.canvas_px_per_m)
    facts["outcome_of_flight"] = np.array([str(trace.claimed), trace.reason], dtype=str)
    facts["plan"], facts["preset"] = np.array(json.dumps(trace.plan)), np.array(trace.preset)
    facts["legs"] = np.array(json.dumps(trace.legs))
    facts["world"] = np.array(world_name(trace.scene.errors))
    facts["seed"], facts["wall_time_s"] = np.array(trace.seed), np.array(trace.wall_time_s)
    return facts


def load_run(path: str | Path) -> dict[str, Trace]:
    """Read the traces of a run folder back, without pictures; of a killed run those ticks that reached the disk.

    Args:
        path: The run folder.

    Returns:
        One trace per law, in the order flown.

    Raises:
        ConfigError: When a file is missing, damaged, or no log of a flight.
    """
    file = Path(path) / "log.npz"
    if not file.exists() and (left := unfinished_run(Path(path))):
        return left
    scene = load_scene(Path(path) / "scene.toml")
    arrays = read_npz(file, LARGEST_LOG, LARGEST_ARRAYS)
    traces: dict[str, Trace] = {}
    for law in dict.fromkeys(name.split("/")[0] for name in arrays):
        own = {name.split("/", 1)[1]: values for name, values in arrays.items() if name.startswith(law + "/")}
        try:
            traces[law] = trace_of(law, scene, own)
        except KeyError as error:
            raise UnreadableFile(file, f"no log of a flight: law {law!r} has no array {error}") from None
        except (TypeError, ValueError, OverflowError) as error:
            raise UnreadableFile(file, f"no log of a flight: law {law!r}: {error}") from None
    return traces


def trace_of(law: str, scene: Scene, arrays: dict[str, np.ndarray]) -> Trace:
    """The trace of one law; the arrays that are not its own are taken out."""
    check_arrays(arrays)
    claimed, reason = _texts(arrays.pop("outcome_of_flight"))
    event_t, event_text = arrays.pop("event_t"), arrays.pop("event_text").reshape(-1, 2)
    coverage = arrays.pop("coverage_percent", None)
    arrays.pop("world", None)  # the scene holds the errors themselves
    texts = [_texts(text) for text in event_text]
    return Trace(
        scene=scene,
        seed=int(arrays.pop("seed")),
        law=law,
        phases=_texts(arrays.pop("phases")),
        outcomes=_texts(arrays.pop("outcomes")),
        limits=_texts(arrays.pop("limits")),
        events=[Event(t=float(t), kind=kind, text=text) for t, (kind, text) in zip(event_t, texts, strict=True)],
        claimed=claimed == "True",
        plan=_plan(arrays.pop("plan", None)),
        legs=_legs(arrays.pop("legs", None)),
        reason=reason,
        preset="".join(_texts(arrays.pop("preset", np.array("")))),
        wall_time_s=float(arrays.pop("wall_time_s")),
        canvas=arrays.pop("canvas", None),
        canvas_px_per_m=float(arrays.pop("canvas_px_per_m", 0.0)),
        coverage_mask=None if coverage is None else coverage.astype(np.float32) / 100,
        arrays=arrays,
    )


def _plan(array: np.ndarray | None) -> dict[str, float]:
    """Durations of the phases of a job without strokes; an older log has none."""
    plan = json.loads("".join(_texts(array))) if array is not None else {}
    if plan and not (isinstance(plan, dict) and plan.keys() == {"press", "paint", "descend"}):
        raise ValueError(f"plan {plan!r} of a flight")
    return {name: float(value) for name, value in plan.items()}


def _legs(array: np.ndarray | None) -> tuple[tuple[float, float], ...] | None:
    """Legs of a strategy of the user's; an older log has none."""
    legs = json.loads("".join(_texts(array))) if array is not None else None
    return None if legs is None else tuple((float(right), float(down)) for right, down in legs)


def _texts(array: np.ndarray) -> tuple[str, ...]:
    """Entries of an array of text that a terminal can print; ValueError for a surrogate or a number beyond Unicode."""
    return tuple(str(entry).encode().decode() for entry in array.reshape(-1))
