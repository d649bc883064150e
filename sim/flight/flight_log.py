"""log.npz of a run: every array of every law, written and read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sim.flight.trace import Event, Trace
from sim.world.scene import load_scene
from sim.world.worlds import world_name


def save_log(file: Path, traces: dict[str, Trace]) -> None:
    """Write every array of every law into one npz file, named ``<law>/<array>``."""
    content: dict[str, Any] = {}
    for law, trace in traces.items():
        arrays = dict(trace.arrays)
        for name in ("phases", "outcomes", "limits"):
            arrays[name] = np.array(getattr(trace, name), dtype=str)
        arrays["event_t"] = np.array([event.t for event in trace.events])
        arrays["event_text"] = np.array([[event.kind, event.text] for event in trace.events], dtype=str)
        if trace.canvas is not None and trace.coverage_mask is not None:
            arrays["canvas"] = trace.canvas
            arrays["coverage_percent"] = np.round(100 * trace.coverage_mask).astype(np.uint8)
            arrays["canvas_px_per_m"] = np.array(trace.canvas_px_per_m)
        arrays["outcome_of_flight"] = np.array([str(trace.completed), trace.reason], dtype=str)
        arrays["preset"], arrays["world"] = np.array(trace.preset), np.array(world_name(trace.scene.errors))
        arrays["seed"], arrays["wall_time_s"] = np.array(trace.seed), np.array(trace.wall_time_s)
        content.update({f"{law}/{name}": values for name, values in arrays.items()})
    np.savez_compressed(file, **content)


def load_run(path: str | Path) -> dict[str, Trace]:
    """Read the traces of a run folder back, without pictures.

    Args:
        path: The run folder.

    Returns:
        One trace per law, in the order flown.
    """
    path = Path(path)
    scene = load_scene(path / "scene.toml")
    traces: dict[str, Trace] = {}
    with np.load(path / "log.npz") as log:
        for law in dict.fromkeys(name.split("/")[0] for name in log.files):
            arrays = {name.split("/", 1)[1]: log[name] for name in log.files if name.startswith(law + "/")}
            completed, reason = arrays.pop("outcome_of_flight")
            event_t, event_text = arrays.pop("event_t"), arrays.pop("event_text").reshape(-1, 2)
            coverage = arrays.pop("coverage_percent", None)
            arrays.pop("world", None)  # the scene holds the errors themselves
            traces[law] = Trace(
                scene=scene,
                seed=int(arrays.pop("seed")),
                law=law,
                phases=tuple(map(str, arrays.pop("phases"))),
                outcomes=tuple(map(str, arrays.pop("outcomes"))),
                limits=tuple(map(str, arrays.pop("limits"))),
                events=[
                    Event(t=float(t), kind=str(k), text=str(x)) for t, (k, x) in zip(event_t, event_text, strict=True)
                ],
                completed=str(completed) == "True",
                reason=str(reason),
                preset=str(arrays.pop("preset", "")),
                wall_time_s=float(arrays.pop("wall_time_s")),
                canvas=arrays.pop("canvas", None),
                canvas_px_per_m=float(arrays.pop("canvas_px_per_m", 0.0)),
                coverage_mask=None if coverage is None else coverage.astype(np.float32) / 100,
                arrays=arrays,
            )
    return traces
