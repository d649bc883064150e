"""Classes named as ``module:Class`` or ``file.py:Class`` in options and specs: strategies, laws, tasks and limits."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import sys
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import ibvs_qp
from ibvs_qp.config.errors import ConfigError

Own = TypeVar("Own")

#: Longest text of an exception in a message [characters].
LONGEST = 200


def built(name: str, base: type[Own] | tuple[type[Own], ...], option: str, *arguments: Any) -> Own:
    """An instance of a class of the user's.

    Args:
        name: ``module:Class``, imported as Python does and from the current folder, or ``file.py:Class``.
        base: Required base class, or several of which one is required.
        option: Option that names it, for messages.
        arguments: Of its constructor.

    Raises:
        ConfigError: When there is no such class, or its module or constructor raises.
    """
    place, colon, word = name.rpartition(":")
    if not (colon and place and word.isidentifier()):
        raise ConfigError(f"{option} {name}: give module:Class or file.py:Class")
    own = getattr(_module(place, f"{option} {name}"), word, None)
    if not isinstance(own, type):
        raise ConfigError(f"{option} {name}: {place} has no class {word}")
    if not issubclass(own, base):
        bases = " or ".join(map(_public, base if isinstance(base, tuple) else (base,)))
        raise ConfigError(f"{option} {name}: {word} is no subclass of {bases}")
    try:
        return own(*arguments)
    except (Exception, SystemExit) as error:  # of the user's code
        raise ConfigError(f"{option} {name}: {word}(...) raises {described(error)}") from error


def source_of(name: str) -> str:
    """Source code of the module of a class, for hashes."""
    return inspect.getsource(_module(name.rpartition(":")[0], name))


def _module(place: str, given: str) -> ModuleType:
    """The module of a name or file, imported once."""
    try:
        if not place.endswith(".py"):
            if "" not in sys.path:
                sys.path.insert(0, "")
            return importlib.import_module(place)
        file = Path(place).resolve()
        if not file.is_file():
            raise ConfigError(f"{given}: there is no file {place}")
        name = f"own_{hashlib.sha256(str(file).encode()).hexdigest()[:8]}_{file.stem}"  # no library's name
        if name in sys.modules:
            return sys.modules[name]
        spec = importlib.util.spec_from_file_location(name, file)
        assert spec is not None and spec.loader is not None
        module = sys.modules[name] = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
        return module
    except ConfigError:
        raise
    except (Exception, SystemExit) as error:  # of the user's code
        raise ConfigError(f"{given}: {place} cannot be imported: {described(error)}") from error


def _public(kind: type) -> str:
    """Name under which a class is imported."""
    name, parent = kind.__name__, sys.modules[kind.__module__.rpartition(".")[0]]
    place = next((each for each in (ibvs_qp, parent) if hasattr(each, name)), sys.modules[kind.__module__])
    return f"{place.__name__}.{name}"


def described(error: BaseException) -> str:
    """Type and text of an exception of the user's code."""
    return f"{type(error).__name__}: {str(error)[:LONGEST]}"
