"""Arrays and JSON from files of unknown origin: plain data within the size of the file, or one refusal."""

from __future__ import annotations

import contextlib
import json
import math
import os
import threading
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ibvs_qp.config.files import UnreadableFile, open_regular, read_bytes
from sim.storage.limits import LARGEST_JSON

#: Kinds of elements: boolean, integers, floating point, text; never Python objects.
_KINDS = "biufU"
_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def read_npz(file: Path, largest: int, unpacked: int) -> dict[str, np.ndarray]:
    """All arrays of an npz file by name.

    Args:
        file: The file.
        largest: Largest size of the file [bytes].
        unpacked: Largest size of the arrays together [bytes].

    Raises:
        UnreadableFile: When it is no such file, or larger.
    """
    with open_regular(file, largest) as stream:
        try:
            with zipfile.ZipFile(stream) as archive:
                members = archive.infolist()
                size = sum(member.file_size for member in members)
                if size > unpacked:
                    raise ValueError(f"its arrays have {size} bytes, at most {unpacked} are read")
                return {each.filename.removesuffix(".npy"): _member(archive, each) for each in members}
        except Exception as error:  # damaged archives and headers fail in a dozen ways
            raise _refusal(file, "npz", error) from None


def read_npy(file: Path, largest: int) -> np.ndarray:
    """The array of an npy file.

    Args:
        file: The file.
        largest: Largest size [bytes].

    Raises:
        UnreadableFile: When it is no such file, or larger.
    """
    with open_regular(file, largest) as stream:
        try:
            return _array(stream, largest)
        except Exception as error:
            raise _refusal(file, "npy", error) from None


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(member) as stream:
        return _array(stream, member.file_size)  # type: ignore[arg-type]


def _array(stream: BinaryIO, largest: int) -> np.ndarray:
    shape, fortran, dtype = _HEADERS[np.lib.format.read_magic(stream)](stream)
    count = math.prod(shape)
    if dtype.kind not in _KINDS or dtype.itemsize == 0 or min(shape, default=0) < 0:
        raise ValueError(f"elements of type {dtype}, shape {shape}")
    if count * dtype.itemsize > largest:
        raise ValueError(f"shape {shape} needs more bytes than the file has")
    content = bytearray(stream.read(count * dtype.itemsize))
    if len(content) != count * dtype.itemsize or stream.read(1):  # the end of a zip member checks its sum
        raise ValueError(f"shape {shape} has another number of bytes than the file")
    return np.frombuffer(content, dtype, count).reshape(shape, order="F" if fortran else "C")


def _refusal(file: Path, kind: str, error: Exception) -> UnreadableFile:
    return UnreadableFile(file, f"no {kind} file of plain arrays ({type(error).__name__}: {error})")


_one_at_a_time = threading.Lock()


@contextlib.contextmanager
def no_library_output() -> Iterator[None]:
    """Close standard error for the duration: decoders print a damaged file's warnings, Polars a stack trace."""
    with _one_at_a_time, open(os.devnull, "wb") as nothing:
        kept = os.dup(2)
        os.dup2(nothing.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def read_json(file: Path) -> Any:
    """Content of a JSON file.

    Raises:
        UnreadableFile: When it cannot be read or is no JSON; 1000 levels of nesting are none that is read.
    """
    try:
        return json.loads(read_bytes(file, LARGEST_JSON))
    except (ValueError, RecursionError) as error:
        raise UnreadableFile(file, f"no JSON ({type(error).__name__}: {error})") from None
