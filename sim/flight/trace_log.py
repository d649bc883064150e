"""Log level ``trace``: one flight in one small file, from which every figure of merit can be computed again.

It has the inputs of the figures only (`FIGURE_INPUTS`), the contact at the physics rate, and the paint coverage.
Signals are rounded to single precision (1e-7 of their value) and times to 1 ns; all else is exact, and the tip, whose
place decides to which stroke, corner or piece of a line a tick belongs. A signal is stored as the differences of its
bit patterns from tick to tick, by bytes, highest bytes together: these change little, so that they compress well.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ibvs_qp.config.files import UnreadableFile, parse_toml
from ibvs_qp.config.settings import dump_toml, from_dict
from sim.flight.flight_log import facts_of, trace_of
from sim.flight.trace import FIGURE_INPUTS, Trace
from sim.storage.arrays import read_npz
from sim.storage.atomic import replacing
from sim.storage.limits import LARGEST_ARRAYS, LARGEST_LOG
from sim.world.scene import Scene

#: Ending of the names of packed signals.
_PACKED = "~"
#: Arrays of one number per rotor, or one in all: stored as they are.
_AS_THEY_ARE = ("thrust_min", "thrust_max", "true_thrust_min", "true_thrust_max", "true_mass")
#: Signals in double precision.
_EXACT = ("tip",)
_NS = 1e-9


def save_trace(file: Path, trace: Trace) -> None:
    """Write the inputs of every figure of one flight.

    Raises:
        UnwritableFile: When the disk is full or the file cannot be written.
    """
    content: dict[str, Any] = facts_of(trace)
    content |= {"law": np.array(trace.law), "scene": np.array(dump_toml(trace.scene))}
    for name in FIGURE_INPUTS:
        if (values := trace.arrays.get(name)) is None:
            continue
        if name == "t":
            content[name + _PACKED] = np.diff(np.round(values / _NS).astype(np.int64), prepend=0)
        elif values.dtype.kind == "f" and name not in _AS_THEY_ARE:
            content[name + _PACKED] = _packed(values, np.float64 if name in _EXACT else np.float32)
        else:
            content[name] = values
    with replacing(file) as stream:
        np.savez_compressed(stream, **content)


def load_trace(file: Path) -> Trace:
    """Read a flight back; arrays other than `FIGURE_INPUTS`, the canvas and the pictures are missing.

    Raises:
        ConfigError: When the file is missing, damaged, or no trace.
    """
    arrays = read_npz(file, LARGEST_LOG, LARGEST_ARRAYS)
    try:
        law, text = ("".join(arrays.pop(name).reshape(-1).tolist()) for name in ("law", "scene"))
        for name in [name for name in arrays if name.endswith(_PACKED)]:
            values, plain = arrays.pop(name), name.removesuffix(_PACKED)
            arrays[plain] = np.cumsum(values) * _NS if plain == "t" else _unpacked(values)
        return trace_of(law, from_dict(Scene, parse_toml(text, file)), arrays)
    except KeyError as error:
        raise UnreadableFile(file, f"no trace of a flight: it has no array {error}") from None
    except (TypeError, ValueError, OverflowError) as error:
        raise UnreadableFile(file, f"no trace of a flight: {error}") from None


def _packed(values: np.ndarray, kind: type[np.floating]) -> np.ndarray:
    """Bytes of the differences of a signal (N,) or (N, w), (4 or 8, N) or (4 or 8, w, N)."""
    bits = np.ascontiguousarray(values.T, kind)
    bits = bits.view(f"i{bits.itemsize}")
    steps = np.diff(bits, prepend=np.zeros_like(bits, shape=(*bits.shape[:-1], 1)))  # wraps around
    return np.ascontiguousarray(np.moveaxis(steps[..., None].view(np.uint8), -1, 0))


def _unpacked(planes: np.ndarray) -> np.ndarray:
    """Inverse of `_packed`."""
    size = len(planes)
    steps = np.ascontiguousarray(np.moveaxis(planes.astype(np.uint8), 0, -1)).view(f"i{size}")[..., 0]
    return np.cumsum(steps, axis=-1, dtype=steps.dtype).view(f"f{size}").astype(float).T
