"""State of a simulated world: everything that objects reach and that changes, kept and put back in place.

Compiled functions and MuJoCo are bound to the memory of arrays, so nothing is built anew: the snapshot keeps the
contents of every mutable object (arrays, lists, random generators, cells of closures, attributes), and `restore` writes
them back into the same objects. The pilot keeps its own state (`Pilot.state`).
"""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import copy
import functools
import itertools
import types
from collections import deque
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

#: Contents of a mutable object, and how to put them back.
Restorer = Callable[[], None]
#: Arrays of a MuJoCo model that a flight changes: the contact, see `sim.world.contact`.
_MODEL_ARRAYS = "pair_solref pair_solreffriction pair_solimp pair_friction pair_margin pair_gap".split()
#: Arrays from this size on are kept in blocks that snapshots share where nothing has changed [bytes].
_SHARED_BYTES, _BLOCKS = 1 << 16, 64
#: Modules whose objects change in a flight.
_PACKAGES = ("sim.", "ibvs_qp.", "allocation.")
_ITERATOR = type(iter(np.zeros((1, 1))))


class Blocks:
    """Copies of large arrays in blocks of rows; unchanged blocks are shared between successive snapshots."""

    def __init__(self) -> None:
        self._last: dict[int, list[np.ndarray]] = {}
        self._present: dict[int, list[np.ndarray]] = {}

    def copy(self, array: np.ndarray) -> list[np.ndarray]:
        """The array as a list of blocks, read-only."""
        blocks, last = np.array_split(array, min(_BLOCKS, len(array))), self._last.get(id(array), [])
        kept = [
            old if old is not None and _same(old, new) else new.copy()
            for old, new in itertools.zip_longest(last[: len(blocks)], blocks)
        ]
        self._present[id(array)] = kept
        return kept

    def end(self) -> None:
        """End a snapshot; arrays that are not in it are forgotten: their numbers may belong to others later."""
        self._last, self._present = self._present, {}


class WorldState:
    """Snapshot of some objects and all that they reach; `restore` continues from it any number of times.

    Args:
        roots: The objects.
        apart: Objects that are not followed.
        blocks: Shared copies of large arrays.
    """

    def __init__(self, roots: tuple[Any, ...], apart: tuple[Any, ...], blocks: Blocks) -> None:
        self._restorers: list[Restorer] = []
        self._blocks = blocks  # shared with the snapshots before
        self._alive: list[Any] = []  # numbers of objects must not be used again meanwhile
        self._known = {id(each) for each in apart}
        queue = list(roots)
        while queue:
            queue.extend(self._keep(queue.pop()))
        blocks.end()

    def restore(self) -> None:
        """Put everything back."""
        for restorer in self._restorers:
            restorer()

    def _keep(self, value: Any) -> list[Any]:
        """Keep the contents of one object; returns the objects in it."""
        if value is None or isinstance(value, (bool, int, float, str, bytes, type)) or id(value) in self._known:
            return []
        self._known.add(id(value))
        self._alive.append(value)
        inside: list[Any] = []
        if isinstance(value, np.ndarray):
            if value.flags.writeable:
                self._restorers.append(self._array(value))
        elif isinstance(value, (list, deque, set, dict)):
            self._restorers.append(functools.partial(_refill, value, copy.copy(value)))
            inside = list(value.values()) if isinstance(value, dict) else list(value)
        elif isinstance(value, tuple):
            inside = list(value)
        elif isinstance(value, np.random.Generator):
            bits = value.bit_generator
            self._restorers.append(functools.partial(setattr, bits, "state", copy.deepcopy(bits.state)))
        elif isinstance(value, types.FunctionType):
            for cell in value.__closure__ or ():
                self._restorers.append(functools.partial(setattr, cell, "cell_contents", cell.cell_contents))
                inside.append(cell.cell_contents)
        elif isinstance(value, functools.partial):
            inside = [value.func, *value.args, *value.keywords.values()]
        elif isinstance(value, types.MethodType):
            inside = [value.__self__]
        elif isinstance(value, mujoco.MjModel):
            inside = [getattr(value, name) for name in _MODEL_ARRAYS]
        elif isinstance(value, mujoco.MjData):
            self._restorers.append(_physics(value))
        elif type(value).__module__.startswith(_PACKAGES) and hasattr(value, "__dict__"):
            own = dict(vars(value))
            iterators = {name: copy.copy(entry) for name, entry in own.items() if isinstance(entry, _ITERATOR)}
            self._restorers.append(functools.partial(_reset, value, own, iterators))
            inside = [entry for name, entry in own.items() if name not in iterators]
        return inside

    def _array(self, array: np.ndarray) -> Restorer:
        if array.nbytes >= _SHARED_BYTES and array.ndim > 0:
            blocks = self._blocks.copy(array)
            return lambda: np.concatenate(blocks, out=array)  # type: ignore[arg-type, return-value]
        return functools.partial(np.copyto, array, array.copy())


def _same(old: np.ndarray, new: np.ndarray) -> bool:
    return old.dtype == new.dtype and old.shape == new.shape and np.array_equal(old, new)


def _refill(container: Any, content: Any) -> None:
    container.clear()
    (container.extend if isinstance(container, (list, deque)) else container.update)(content)


def _reset(value: Any, own: dict[str, Any], iterators: dict[str, Any]) -> None:
    attributes = vars(value)
    attributes.clear()
    attributes.update(own | {name: copy.copy(entry) for name, entry in iterators.items()})


def _physics(data: mujoco.MjData) -> Restorer:
    model, part = data.model, mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, part))
    mujoco.mj_getState(model, data, state, part)
    return lambda: mujoco.mj_setState(model, data, state, part)
