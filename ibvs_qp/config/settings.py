"""Validated settings: dataclass fields that carry unit, allowed range and meaning, and their TOML form.

Every configuration of the project (controller, pilot, scene) is a tree of frozen dataclasses with fields of `setting`
and `choice`. The same metadata validates a value, explains its error, and documents it.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import numbers
import types
import typing
from pathlib import Path
from typing import Any, TypeVar

from ibvs_qp.config.errors import ConfigError, out_of_range, shown
from ibvs_qp.config.files import read_toml

T = TypeVar("T")


class Derived(float):
    """A number that follows from the vehicle: computed anew for another vehicle, and left out of TOML files."""


def setting(
    default: Any,
    doc: str,
    unit: str = "",
    low: float = -math.inf,
    high: float = math.inf,
    *,
    why: str = "",
    words: tuple[str, ...] = (),
) -> Any:
    """Declare a settings field with its unit and closed allowed range [low, high].

    Args:
        default: Number, boolean, string, or tuple of numbers; None for a value that follows from others.
        doc: Meaning, and source of the value unless ``why`` gives it.
        unit: SI unit, empty for a pure number.
        low: Smallest allowed value, of each entry for tuples.
        high: Largest allowed value.
        why: Reason for the default.
        words: Strings that are allowed as well as numbers.
    """
    limits = {"low": low, "high": high, "words": words}
    return dataclasses.field(default=default, metadata={"doc": doc, "unit": unit, "why": why, **limits})


def choice(default: str, doc: str, options: tuple[str, ...]) -> Any:
    """Declare a settings field with a closed set of values."""
    return dataclasses.field(default=default, metadata={"doc": doc, "unit": "", "options": options})


def validate(instance: Any) -> None:
    """Check every field of a settings dataclass against its metadata.

    Raises:
        ConfigError: Naming field, value, unit and allowed range.
    """
    for field in dataclasses.fields(instance):
        meta, value, name = field.metadata, getattr(instance, field.name), field.name
        if "options" in meta:
            if value not in meta["options"]:
                raise out_of_range(name, value, "", "allowed are " + ", ".join(meta["options"]))
        elif "low" in meta:
            _check_number(name, value, field.default, meta)


class Checked:
    """Base of a settings section that refuses values out of range at construction."""

    def __post_init__(self) -> None:
        """Validate every field."""
        validate(self)


def require_order(instance: Any, smaller: str, larger: str, reason: str) -> None:
    """Require that one field lies below another; None has no order.

    Args:
        instance: The settings.
        smaller: Name of the smaller field.
        larger: Name of the larger field, in the same unit.
        reason: Consequence of the wrong order.

    Raises:
        ConfigError: Naming both fields, their values and their unit.
    """
    low, high = getattr(instance, smaller), getattr(instance, larger)
    if low is not None and high is not None and not low < high:
        unit = next(field.metadata["unit"] for field in dataclasses.fields(instance) if field.name == larger)
        raise out_of_range(smaller, low, unit, f"must lie below {larger} = {high!r} {unit}: {reason}")


def derive(section: T, values: dict[str, float]) -> T:
    """A settings section with derived values where none is stated.

    Args:
        section: A settings dataclass; a field that is None or `Derived` is not stated.
        values: Derived values by field.
    """
    own: dict[str, Any] = {name: getattr(section, name) for name in values}
    open_ones = {name: Derived(values[name]) for name, value in own.items() if value is None or type(value) is Derived}
    return dataclasses.replace(section, **open_ones)  # type: ignore[type-var]


def stated(section: T) -> T:
    """The same section with its derived values as if they were stated."""
    values = {field.name: getattr(section, field.name) for field in dataclasses.fields(section)}  # type: ignore[arg-type]
    fixed: dict[str, Any] = {name: float(value) for name, value in values.items() if type(value) is Derived}
    return dataclasses.replace(section, **fixed)  # type: ignore[type-var]


def _check_number(name: str, value: Any, default: Any, meta: typing.Mapping[str, Any]) -> None:
    if isinstance(default, (bool, str)) or (value is None and default is None):
        return
    low, high, unit, words = meta["low"], meta["high"], meta["unit"], meta["words"]
    if isinstance(value, str) and value in words:
        return
    number = numbers.Integral if isinstance(default, int) else numbers.Real
    for entry in value if isinstance(value, tuple) else (value,):
        right_type = isinstance(entry, number) and not isinstance(entry, bool)
        if not (right_type and _is_finite(entry) and low <= entry <= high):
            allowed = f"allowed is [{low:g}, {high:g}] {unit}".rstrip()
            raise out_of_range(name, value, unit, " or ".join([allowed, *(repr(word) for word in words)]))


def _is_finite(value: Any) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond every float
        return False


def from_dict(kind: type[T], table: dict[str, Any], path: str = "") -> T:
    """Build a settings dataclass from a (TOML) table; unknown keys and wrong types are errors.

    Args:
        kind: The dataclass to build.
        table: Keys and values; nested tables become nested dataclasses, lists become tuples.
        path: Dotted path of this table, for messages.

    Raises:
        ConfigError: On an unknown key, a value of the wrong type or out of range.
    """
    known = _settable(kind)
    values: dict[str, Any] = {}
    for key, value in table.items():
        place = f"{path}.{key}" if path else key
        if key not in known:
            import difflib

            near = difflib.get_close_matches(key, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else f"; known keys: {', '.join(known)}"
            raise ConfigError(f"unknown key {shown(place)}{hint}")
        values[key] = _convert(known[key], value, place)
    try:
        return kind(**values)
    except ConfigError as error:
        raise ConfigError(f"{path}.{error}" if path and not str(error).startswith(path + ".") else str(error)) from None
    except (TypeError, ValueError) as error:  # a dataclass of another package, or a missing field without default
        raise ConfigError(f"{path or 'table'}: {error}") from None


def adjusted(config: Any, section: str, values: dict[str, Any]) -> Any:
    """A section of a configuration with other values, checked as `from_dict` does."""
    checked = from_dict(type(getattr(config, section)), values, section)
    try:
        return dataclasses.replace(getattr(config, section), **{name: getattr(checked, name) for name in values})
    except ConfigError as error:
        raise ConfigError(f"{section}.{error}") from None


@functools.cache
def _settable(kind: type) -> dict[str, Any]:
    """Types of the fields of a dataclass by name."""
    hints = typing.get_type_hints(kind)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind) if field.init}


def _convert(hint: Any, value: Any, place: str) -> Any:
    origin = typing.get_origin(hint)
    if origin in (typing.Union, types.UnionType):
        problems = []
        for option in typing.get_args(hint):
            try:
                return _convert(option, value, place)
            except ConfigError as error:
                problems.append(str(error))
        raise ConfigError(problems[0])
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        if not isinstance(value, dict):
            raise ConfigError(f"{place} must be a table, got {shown(value)}")
        return from_dict(hint, value, place)
    if origin is tuple:
        return _convert_tuple(hint, value, place)
    if origin is dict:
        if not isinstance(value, dict):
            raise ConfigError(f"{place} must be a table, got {shown(value)}")
        return {key: _convert(typing.get_args(hint)[1], entry, f"{place}.{key}") for key, entry in value.items()}
    kinds = {float: (int, float), int: (int,), bool: (bool,), str: (str,), type(None): (type(None),)}.get(hint)
    wrong = kinds is None or not isinstance(value, kinds) or (hint in (int, float) and isinstance(value, bool))
    if wrong or (hint is float and isinstance(value, int) and not _is_finite(value)):
        raise ConfigError(f"{place} = {shown(value)} is refused: a {getattr(hint, '__name__', hint)} is needed")
    return float(value) if hint is float else value


def _convert_tuple(hint: Any, value: Any, place: str) -> tuple[Any, ...]:
    arguments = typing.get_args(hint)
    if not isinstance(value, (list, tuple)):
        raise ConfigError(f"{place} = {shown(value)} is refused: a list is needed")
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        return tuple(_convert(arguments[0], entry, place) for entry in value)
    if len(arguments) != len(value):
        raise ConfigError(f"{place} = {shown(value)} is refused: a list of {len(arguments)} is needed")
    return tuple(_convert(kind, entry, place) for kind, entry in zip(arguments, value, strict=True))


def to_dict(instance: Any, *, derived: bool = False) -> dict[str, Any]:
    """Convert a settings tree to plain tables, without None: TOML has no null.

    Args:
        instance: The settings.
        derived: Whether values that follow from others are in the tables too, as if they were stated.
    """
    table: dict[str, Any] = {}
    for field in dataclasses.fields(instance):
        value = getattr(instance, field.name)
        if value is not None and (derived or type(value) is not Derived):
            table[field.name] = _plain(value, derived)
    return table


def _plain(value: Any, derived: bool) -> Any:
    if dataclasses.is_dataclass(value):
        return to_dict(value, derived=derived)
    if isinstance(value, tuple):
        return [_plain(entry, derived) for entry in value]
    return float(value) if type(value) is Derived else value


def load_toml(kind: type[T], file: str | Path) -> T:
    """Read a settings tree from a TOML file.

    Raises:
        ConfigError: When the file cannot be read, is not TOML, or contains a refused value.
    """
    table = read_toml(file)
    try:
        return from_dict(kind, table)
    except ConfigError as error:
        raise ConfigError(f"{file}: {error}") from None


def dump_toml(instance: Any, *, derived: bool = False) -> str:
    """Write a settings tree as TOML text; `load_toml` restores an equal tree. Arguments as for `to_dict`."""
    import tomli_w  # not needed to control, and missing in a light installation

    return tomli_w.dumps(to_dict(instance, derived=derived))
