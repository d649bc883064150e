"""State of a flight: everything that changes from tick to tick, as one object that can be kept, pickled and restored.

A *part* is an object with `reset`, reached from a pilot or controller through attributes. The state of a part is all of
its attributes but functions and ``CONSTANTS``, or those that it names in ``STATE``; one with memory that compiled code
is bound to copies it itself (``save_memory``, ``load_memory``). References from part to part stay references.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

from ibvs_qp.config.errors import ConfigError


@dataclass(frozen=True)
class _Reference:
    """Stands for a part in the state of another one."""

    path: str
    kind: str  # its class; of compiled code also its size


@dataclass(frozen=True, eq=False)
class FlightState:
    """Snapshot of a `Pilot`, an `Assured` or a controller; `restore` continues from it any number of times.

    Attributes:
        kind: Class that the snapshot is of.
        config: Its configuration.
        values: State of every part, by the part's path of attributes.
    """

    kind: str
    config: Any
    values: dict[str, Any]
    _references: dict[str, _Reference]


def take_state(root: Any, config: Any) -> FlightState:
    """State of a pilot or controller with a configuration."""
    parts = _parts(root)
    references = {path: _Reference(path, _kind(part)) for path, part in parts.items()}
    # Entries of its memo are not copied by `deepcopy`: parts become references, settings stay as they are.
    memo: dict[int, Any] = {id(part): references[path] for path, part in parts.items()}
    memo |= {id(settings): settings for settings in _settings(config)}
    values = copy.deepcopy({path: _state(part) for path, part in parts.items()}, memo)
    return FlightState(type(root).__qualname__, config, values, references)


def put_state(root: Any, config: Any, state: FlightState) -> None:
    """Continue from a state.

    Raises:
        ConfigError: When the state is that of another class or configuration.
    """
    if not isinstance(state, FlightState):
        raise ConfigError(f"state: {type(state).__name__}, not a FlightState")
    if state.kind != type(root).__qualname__:
        raise ConfigError(f"state: of a {state.kind}, not of a {type(root).__qualname__}")
    parts, references = _parts(root), state._references
    kinds = {path: _kind(part) for path, part in parts.items()}
    if state.config != config or any(kinds.get(path) != reference.kind for path, reference in references.items()):
        raise ConfigError(f"state: of a {state.kind} with another configuration, strategy, tasks or limits")
    for path in parts.keys() - references.keys():  # perception that was not loaded
        parts[path].reset()
    memo = {id(reference): parts[path] for path, reference in references.items()}
    for path, values in copy.deepcopy(state.values, memo).items():
        part = parts[path]
        if hasattr(part, "load_memory"):
            part.load_memory(values)
        else:
            vars(part).update(values)


class Rebuilt(ABC):
    """An object with `state` and `restore` whose copies and pickles are built anew from its constructor's arguments.

    The arguments are those of the outermost class, so a subclass with its own constructor is copied as well.
    """

    _make: Callable[[], Any]

    def __new__(cls, *arguments: Any, **named: Any) -> Self:
        """Keep the arguments."""
        made = super().__new__(cls)
        made._make = functools.partial(cls, *arguments, **named)
        return made

    @abstractmethod
    def state(self) -> FlightState:
        """Everything that changes from step to step."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Built from the same arguments, in the present state."""
        return copied, (self._make, self.state())

    def __copy__(self) -> Self:
        """As a deep copy: two pilots must not share a law in flight."""
        return copy.deepcopy(self)


def copied(make: Callable[[], Any], state: FlightState) -> Any:
    """A pilot or controller built anew, in a state."""
    made = make()
    made.restore(state)
    return made


def _parts(root: Any) -> dict[str, Any]:
    """All parts by their paths, the root's is empty."""
    found, known, queue = dict[str, Any](), {id(root)}, [("", root)]
    for path, part in queue:  # grows meanwhile
        found[path] = part
        for name, value in () if hasattr(part, "save_memory") else vars(part).items():
            if hasattr(value, "reset") and not isinstance(value, type) and id(value) not in known:
                known.add(id(value))
                queue.append((f"{path}.{name}" if path else name, value))
    return found


def _kind(part: Any) -> str:
    return f"{type(part).__qualname__} {getattr(part, 'size', '')}"


def _state(part: Any) -> Any:
    """State of a part, not copied."""
    if hasattr(part, "save_memory"):
        return part.save_memory()
    if hasattr(part, "STATE"):
        return {name: getattr(part, name) for name in part.STATE}
    constants = getattr(part, "CONSTANTS", ())
    return {name: value for name, value in vars(part).items() if not (callable(value) or name in constants)}


def _settings(config: Any) -> list[Any]:
    """A configuration and all sections of it."""
    sections = [config]
    for section in sections:  # grows meanwhile
        values = [getattr(section, field.name) for field in dataclasses.fields(section)]
        sections += [value for value in values if dataclasses.is_dataclass(value)]
    return sections
