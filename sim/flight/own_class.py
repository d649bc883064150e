"""Classes named as ``module:Class`` or ``file.py:Class`` in options and specs: strategies, laws, tasks and limits."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import sys
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

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
        bases = " or ".join(f"ibvs_qp.{each.__name__}" for each in (base if isinstance(base, tuple) else (base,)))
        raise ConfigError(f"{option} {name}: {word} is no subclass of {bases}")
    try:
        return own(*arguments)
    except (Exception, SystemExit) as error:  # of the user's code
        raise ConfigError(f"{option} {name}: {word}(...) raises {_described(error)}") from error


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
        spec = importlib.util.spec_from_file_location(file.stem, file)
        assert spec is not None and spec.loader is not None
        before = sys.modules.get(file.stem)
        if before is not None and getattr(before, "__file__", None) == str(file):
            return before
        module = sys.modules[file.stem] = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[file.stem]
            raise
        return module
    except ConfigError:
        raise
    except (Exception, SystemExit) as error:  # of the user's code
        raise ConfigError(f"{given}: {place} cannot be imported: {_described(error)}") from error


def _described(error: BaseException) -> str:
    return f"{type(error).__name__}: {str(error)[:LONGEST]}"
