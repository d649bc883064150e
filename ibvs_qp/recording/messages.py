"""Protobuf messages of the log, made from the dataclasses that they carry: one description of every field.

A float, an array and a tuple of numbers are doubles, so that what is read back equals what was written to the bit. A
value that its field cannot hold, such as None for an attitude, is written as JSON beside the others
(`ibvs_qp.recording.malformed`): the checks of the controller must meet it again when the log is replayed.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import types
import typing
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from ibvs_qp.recording.malformed import from_json, to_json

PACKAGE = "ibvs_qp"
#: Fields that are square matrices, and their size; all other arrays have one dimension.
MATRICES = {"covariance": 2, "velocity_covariance": 3, "segment": 2}
#: Fields that are not in the log: evaluated on reading, or pictures, which have topics of their own.
LEFT_OUT = {"tasks", "image"}
#: Field of the JSON.
MALFORMED = "malformed"
_INT64 = 2**63
_Proto = descriptor_pb2.FieldDescriptorProto
_SCALARS = {
    int: _Proto.TYPE_INT64,
    float: _Proto.TYPE_DOUBLE,
    bool: _Proto.TYPE_BOOL,
    str: _Proto.TYPE_STRING,
}
_POOL = descriptor_pool.DescriptorPool()


@dataclasses.dataclass(frozen=True)
class _Slot:
    """One field: its Python type, whether there are many of it, and whether None is a value."""

    name: str
    kind: type
    many: bool
    optional: bool
    array: bool  # numpy array, otherwise a tuple


@functools.cache
def _slots(kind: type) -> tuple[_Slot, ...]:
    """Fields of a dataclass or named tuple."""
    hints = typing.get_type_hints(kind)
    return tuple(_slot(name, hint) for name, hint in hints.items() if name not in LEFT_OUT)


def _slot(name: str, hint: Any) -> _Slot:
    options = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
    (hint, *_), optional = [option for option in options if option is not type(None)], type(None) in options
    if hint is np.ndarray:
        return _Slot(name, float, True, optional, True)
    if typing.get_origin(hint) is tuple:
        return _Slot(name, typing.get_args(hint)[0], True, optional, False)
    return _Slot(name, hint, False, optional, False)


@functools.cache
def message_class(kind: type) -> type[Any]:
    """The protobuf class of a dataclass."""
    file = descriptor_pb2.FileDescriptorProto(name=f"{PACKAGE}/{kind.__name__}.proto", package=PACKAGE, syntax="proto3")
    message = file.message_type.add(name=kind.__name__)
    for slot in (*_slots(kind), _Slot(MALFORMED, str, False, False, False)):
        plain = str if issubclass(slot.kind, enum.Enum) else slot.kind
        field = message.field.add(name=slot.name, number=len(message.field) + 1, label=_Proto.LABEL_OPTIONAL)
        if slot.many:
            field.label = _Proto.LABEL_REPEATED
        if plain in _SCALARS:
            field.type = _SCALARS[plain]
        else:
            inner = message_class(plain).DESCRIPTOR
            field.type, field.type_name = _Proto.TYPE_MESSAGE, f".{inner.full_name}"
            if inner.file.name not in file.dependency:
                file.dependency.append(inner.file.name)
        if slot.optional and not slot.many and plain in _SCALARS:  # presence, as protoc writes it
            field.proto3_optional, field.oneof_index = True, len(message.oneof_decl)
            message.oneof_decl.add(name=f"_{slot.name}")
    _POOL.Add(file)
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName(f"{PACKAGE}.{kind.__name__}"))


def encode(value: Any, kind: type | None = None) -> Any:
    """Message of a dataclass or named tuple; what a field cannot hold goes to its JSON."""
    kind = kind or type(value)
    values: dict[str, Any] = {}
    odd: dict[str, Any] = {}
    for slot in _slots(kind):
        entry = getattr(value, slot.name)
        if entry is None and slot.optional:
            continue
        try:
            values[slot.name] = _many(slot, entry) if slot.many else _one(slot.kind, entry)
        except (TypeError, ValueError, OverflowError):
            odd[slot.name] = entry
    if odd:
        values[MALFORMED] = to_json(odd)
    return message_class(kind)(**values)


def _many(slot: _Slot, entry: Any) -> list[Any]:
    if slot.kind is float:
        numbers = np.asarray(entry) if type(entry) in (np.ndarray, tuple, list) else None
        shape = (MATRICES[slot.name],) * 2 if slot.name in MATRICES else None
        if numbers is None or numbers.dtype.kind not in "fiu" or numbers.itemsize > 8 or not numbers.size:
            raise TypeError
        if numbers.shape != shape and (shape is not None or numbers.ndim != 1):
            raise TypeError
        return numbers.astype(float).ravel().tolist()
    if not isinstance(entry, tuple | list):
        raise TypeError
    return [_one(slot.kind, each) for each in entry]


def _one(kind: type, entry: Any) -> Any:
    if kind is float:
        if isinstance(entry, bool) or not isinstance(entry, int | float | np.integer | np.floating):
            raise TypeError
        return float(entry)
    if kind is int:
        if isinstance(entry, bool) or not isinstance(entry, int | np.integer) or not -_INT64 <= entry < _INT64:
            raise TypeError
        return int(entry)
    if kind is bool:
        if not isinstance(entry, bool | np.bool_):
            raise TypeError
        return bool(entry)
    if issubclass(kind, str):
        if not isinstance(entry, str):
            raise TypeError
        return str(entry.encode(), "utf-8")  # a lone surrogate raises here
    if not isinstance(entry, kind):
        raise TypeError
    return encode(entry, kind)


def decode(message: Any, kind: type) -> Any:
    """The dataclass or named tuple of a message.

    Raises:
        TypeError, ValueError: When the message does not hold one.
    """
    odd: dict[str, Any] = from_json(message.malformed) if message.malformed else {}
    values: dict[str, Any] = {}
    for slot in _slots(kind):
        entry = getattr(message, slot.name)
        if slot.name in odd:
            values[slot.name] = odd[slot.name]
        elif not slot.many:
            absent = slot.optional and not message.HasField(slot.name)
            plain = slot.kind in _SCALARS or issubclass(slot.kind, enum.Enum)
            values[slot.name] = None if absent else (slot.kind(entry) if plain else decode(entry, slot.kind))
        elif slot.kind is float:
            values[slot.name] = _numbers(slot, entry)
        else:
            plain = slot.kind in _SCALARS
            values[slot.name] = tuple(entry) if plain else tuple([decode(each, slot.kind) for each in entry])
    return kind(**values)


def _numbers(slot: _Slot, entry: Any) -> np.ndarray | tuple[float, ...] | None:
    if slot.optional and not len(entry):
        return None
    if not slot.array:
        return tuple(entry)
    numbers = np.array(entry, float)
    return numbers.reshape((MATRICES[slot.name],) * 2) if slot.name in MATRICES else numbers
