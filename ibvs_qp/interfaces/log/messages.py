"""Protobuf messages of the log, made from the dataclasses that they carry: one description of every field.

A float, an array and a tuple of numbers are doubles, so that values read back are bit-identical. A value that its
field cannot hold, such as None for an attitude, is JSON in the field `MALFORMED`: the replayed controller must refuse
it again.
"""

from __future__ import annotations

import enum
import functools
import json
import types
import typing
from dataclasses import dataclass, is_dataclass
from typing import Any, NamedTuple

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from ibvs_qp.measurement import channels

PACKAGE = "ibvs_qp"
#: Fields that are not in the log: evaluated on reading, or pictures, which have topics of their own.
LEFT_OUT = {"tasks", "image"}
#: Field of the JSON.
MALFORMED = "malformed"
#: Most entries of an array or list in JSON; longest integer [bits]: Python prints no integer of more than 4300 digits.
MOST_ENTRIES, LONGEST_BITS = 1000, 1024
#: Keys of JSON objects that stand for an array, and for a value that JSON cannot hold.
_ARRAY, _OTHER = "array of", "value of type"
_INT64 = 2**63
_Proto = descriptor_pb2.FieldDescriptorProto
#: Types of the scalars, and the values that each can hold; a bool is no number.
_SCALARS = {
    int: (_Proto.TYPE_INT64, (int, np.integer)),
    float: (_Proto.TYPE_DOUBLE, (int, float, np.integer, np.floating)),
    bool: (_Proto.TYPE_BOOL, (bool, np.bool_)),
    str: (_Proto.TYPE_STRING, (str,)),
}
_POOL = descriptor_pool.DescriptorPool()


@dataclass(eq=False)
class Malformed:
    """Stands for a value that JSON cannot hold either, by the name of its type."""

    text: str


class _Slot(NamedTuple):
    """One field of a dataclass or named tuple."""

    name: str
    kind: type
    scalar: type | None  # str for an enumeration, None for a message
    many: bool = False
    optional: bool = False  # None is a value
    array: bool = False  # many as a numpy array, otherwise as a tuple
    shape: tuple[int, ...] = ()  # of a matrix


@functools.cache
def _slots(kind: type) -> tuple[_Slot, ...]:
    known = channels(kind) if is_dataclass(kind) else {}
    return tuple(
        _slot(name, hint, known[name].shape if name in known else ())
        for name, hint in typing.get_type_hints(kind).items()
        if name not in LEFT_OUT
    )


def _slot(name: str, hint: Any, shape: tuple[int, ...]) -> _Slot:
    options = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
    (hint, *_), optional = [option for option in options if option is not types.NoneType], types.NoneType in options
    if hint is np.ndarray:
        return _Slot(name, float, float, True, optional, True, shape if len(shape) > 1 else ())
    many = typing.get_origin(hint) is tuple
    kind = typing.get_args(hint)[0] if many else hint
    scalar = str if issubclass(kind, enum.Enum) else kind if kind in _SCALARS else None
    return _Slot(name, kind, scalar, many, optional)


@functools.cache
def message_class(kind: type) -> type[Any]:
    """The protobuf class of a dataclass."""
    file = descriptor_pb2.FileDescriptorProto(name=f"{PACKAGE}/{kind.__name__}.proto", package=PACKAGE, syntax="proto3")
    message = file.message_type.add(name=kind.__name__)
    for slot in (*_slots(kind), _Slot(MALFORMED, str, str)):
        label = _Proto.LABEL_REPEATED if slot.many else _Proto.LABEL_OPTIONAL
        field = message.field.add(name=slot.name, number=len(message.field) + 1, label=label)
        if slot.scalar is None:
            inner = message_class(slot.kind).DESCRIPTOR
            field.type, field.type_name = _Proto.TYPE_MESSAGE, f".{inner.full_name}"
            if inner.file.name not in file.dependency:
                file.dependency.append(inner.file.name)
            continue
        field.type = _SCALARS[slot.scalar][0]
        if slot.optional and not slot.many:  # presence, as protoc writes it
            field.proto3_optional, field.oneof_index = True, len(message.oneof_decl)
            message.oneof_decl.add(name=f"_{slot.name}")
    _POOL.Add(file)
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName(f"{PACKAGE}.{kind.__name__}"))


def encode(value: Any, kind: type | None = None) -> Any:
    """Message of a dataclass or named tuple."""
    kind = kind or type(value)
    values: dict[str, Any] = {}
    malformed: dict[str, Any] = {}
    for slot in _slots(kind):
        entry = getattr(value, slot.name)
        if entry is None and slot.optional:
            continue
        try:
            values[slot.name] = _many(slot, entry) if slot.many else _one(slot, entry)
        except (TypeError, ValueError, OverflowError):
            malformed[slot.name] = _plain(entry)
    if malformed:
        values[MALFORMED] = json.dumps(malformed)
    return message_class(kind)(**values)


def _many(slot: _Slot, entry: Any) -> list[Any]:
    if slot.kind is float:
        numbers = np.asarray(entry) if type(entry) in (np.ndarray, tuple, list) else None
        if numbers is None or numbers.dtype.kind not in "fiu" or numbers.itemsize > 8 or not numbers.size:
            raise TypeError
        if numbers.shape != (slot.shape or (numbers.size,)):
            raise TypeError
        return numbers.astype(float).ravel().tolist()
    if not isinstance(entry, tuple | list):
        raise TypeError
    return [_one(slot, each) for each in entry]


def _one(slot: _Slot, entry: Any) -> Any:
    if (scalar := slot.scalar) is None:
        if not isinstance(entry, slot.kind):
            raise TypeError
        return encode(entry, slot.kind)
    if not isinstance(entry, _SCALARS[scalar][1]) or (isinstance(entry, bool) and scalar is not bool):
        raise TypeError
    if scalar is int and not -_INT64 <= entry < _INT64:
        raise OverflowError
    value: Any = scalar(entry)
    if scalar is str:
        value.encode()  # a lone surrogate raises here
    return value


def decode(message: Any, kind: type) -> Any:
    """The dataclass or named tuple of a message.

    Raises:
        TypeError, ValueError: When the message does not hold one.
    """
    malformed = malformed_fields(message)
    values: dict[str, Any] = {}
    for slot in _slots(kind):
        entry = getattr(message, slot.name)
        if slot.name in malformed:
            entry = malformed[slot.name]
        elif slot.optional and (not len(entry) if slot.many else not message.HasField(slot.name)):
            entry = None
        elif slot.array:
            entry = np.array(entry, float).reshape(slot.shape or -1)
        elif slot.many:
            entry = tuple(entry) if slot.scalar else tuple([decode(each, slot.kind) for each in entry])
        else:
            entry = slot.kind(entry) if slot.scalar else decode(entry, slot.kind)
        values[slot.name] = entry
    return kind(**values)


def malformed_fields(message: Any) -> dict[str, Any]:
    """Values of a message's JSON by field; tuples became lists.

    Raises:
        ValueError: When `encode` did not write it.
    """
    values = json.loads(message.malformed) if message.malformed else {}
    if not isinstance(values, dict):
        raise ValueError("not an object")
    return {name: _value(entry) for name, entry in values.items()}


def _plain(value: Any, depth: int = 0) -> Any:
    """A value of any type for JSON; numbers keep all digits, NaN and infinity."""
    if value is None or type(value) in (bool, float, str):
        return value
    if type(value) is int and value.bit_length() <= LONGEST_BITS:
        return value
    if type(value) is np.ndarray and value.dtype.kind in "fiub" and value.size <= MOST_ENTRIES:
        return {_ARRAY: str(value.dtype), "entries": value.tolist()}
    if isinstance(value, list | tuple) and len(value) <= MOST_ENTRIES and depth < 4:
        return [_plain(entry, depth + 1) for entry in value]
    return {_OTHER: type(value).__name__}


def _value(entry: Any) -> Any:
    if isinstance(entry, list):
        return [_value(each) for each in entry]
    if not isinstance(entry, dict):
        return entry
    if _OTHER in entry:
        return Malformed(str(entry[_OTHER]))
    kind = np.dtype(str(entry.get(_ARRAY)))
    if kind.kind not in "fiub":
        raise ValueError(f"arrays of {kind}")
    return np.array(entry.get("entries"), kind)
