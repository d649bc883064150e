"""An open bag of ROS 2: files of bounded size, compressed parts that unpack to a bounded size, one line per error."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.config.files import open_regular, read_bytes
from ibvs_qp.interfaces.ros.messages import typestore

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader
    from rosbags.interfaces import Connection

#: Largest metadata and data file of a bag [bytes]: half a terabyte holds three hours of raw pictures.
LARGEST_METADATA, LARGEST_DATA = 4 << 20, 1 << 39
#: Largest chunk and message after decompression [bytes]: four pictures of `interfaces.ros.messages.MOST_ENTRIES`.
LARGEST_UNPACKED = 1 << 28
_METADATA = "metadata.yaml"


class OpenBag:
    """A bag that is open until `close`; any error of the library becomes a ConfigError of one line.

    Attributes:
        connections: Topics with their types.

    Args:
        path: As of `ibvs_qp.interfaces.ros.bag.Bag`.

    Raises:
        ConfigError: When it cannot be read, or is compressed as a whole.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        for file in [path / _METADATA, *sorted(path.iterdir())] if path.is_dir() else [path]:
            open_regular(file, LARGEST_METADATA if file.name == _METADATA else LARGEST_DATA).close()
        store = typestore()  # names the extra where it is missing
        with _one_line(path):
            self._mode = _compression_mode(path)
        if self._mode == "file":
            raise ConfigError(f"{path} is compressed as whole files; decompress them with 'ros2 bag convert'")
        with _one_line(path):
            self._reader = _opened(path)
            self._reader.typestore.max_sequence_length = store.max_sequence_length
        self.connections, self.close = list(self._reader.connections), self._reader.close

    def deserialize(self, data: bytes, name: str) -> Any:
        """Decode a message by the bag's own definitions, or by ours where it has none."""
        return self._reader.deserialize(data, name)

    def messages(self, connections: list[Connection]) -> Iterator[tuple[Connection, bytes]]:
        """Messages of some connections in the order of recording."""
        with _one_line(self._path):
            for connection, _, data in self._reader.messages(connections):
                yield connection, _zstd(data, LARGEST_UNPACKED) if self._mode == "message" else data


@contextlib.contextmanager
def _one_line(path: Path) -> Iterator[None]:
    try:
        yield
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise ConfigError(f"{path} is no readable ROS 2 bag ({shown(reason)[1:-1]})") from None


def _compression_mode(path: Path) -> str:
    """Mode "file" or "message", empty for none: the library unpacks files before it returns the metadata."""
    if not path.is_dir():
        return ""
    from ruamel.yaml import YAML

    table = YAML(typ="safe").load(read_bytes(path / _METADATA, LARGEST_METADATA))
    return str(table["rosbag2_bagfile_information"].get("compression_mode", "")).lower()


def _opened(path: Path) -> AnyReader:
    """The library's reader, which leaves compressed messages as they are, and unpacks chunks by the functions below."""
    from rosbags.highlevel import AnyReader
    from rosbags.rosbag2 import storage_mcap

    storage_mcap.DECOMPRESSORS.update(zstd=_zstd, lz4=_lz4)
    reader = AnyReader([path], default_typestore=typestore())
    reader.open()
    rosbag2: Any = reader.readers[0]
    rosbag2.storage.metadata = rosbag2.storage.metadata._replace(compression_mode=None)
    return reader


def _zstd(data: bytes, size: int) -> bytes:
    from rosbags.rosbag2.storage_mcap import zstd

    return _unpacked(zstd.ZstdDecompressor(), data, size)


def _lz4(data: bytes, size: int) -> bytes:
    from lz4.frame import LZ4FrameDecompressor

    return _unpacked(LZ4FrameDecompressor(), data, size)


def _unpacked(decompressor: Any, data: bytes, size: int) -> bytes:
    """A frame of at most a size and at most `LARGEST_UNPACKED` [bytes]."""
    largest = min(size, LARGEST_UNPACKED)
    raw = decompressor.decompress(data, largest + 1)
    if len(raw) > largest or not decompressor.eof:
        raise ValueError(f"a compressed part is cut, or has more than {largest} bytes")
    return raw
