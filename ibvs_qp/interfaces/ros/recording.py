"""A recorded bag of ROS 2 as a whole: all its storage files, counts that it states, decoders, one line per error."""

from __future__ import annotations

import contextlib
import functools
import heapq
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.config.files import UnreadableFile, open_regular, read_bytes
from ibvs_qp.interfaces.ros.messages import MOST_ENTRIES, typestore
from ibvs_qp.interfaces.ros.storage import (
    LARGEST_DATA,
    MCAP_MAGIC,
    ROS1_MAGIC,
    SQLITE_MAGIC,
    McapStorage,
    Recorded,
    SqliteStorage,
    open_storage,
    unpacked,
)

#: Largest metadata of a bag [bytes].
LARGEST_METADATA = 4 << 20
METADATA = "metadata.yaml"
#: Endings of storage files.
ENDINGS = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd", ".bag")


def is_bag(path: Path) -> bool:
    """Whether a path is a bag of ROS, and not a log of this package: by profile and schemas, not by its name."""
    if path.is_dir():
        return True
    with open_regular(path, LARGEST_DATA) as stream:
        head = stream.read(len(SQLITE_MAGIC))
    if head.startswith((SQLITE_MAGIC, ROS1_MAGIC)):
        return True
    if not head.startswith(MCAP_MAGIC):
        return False
    try:
        with contextlib.closing(McapStorage(path)) as storage:
            return storage.profile == "ros2" or any(each.format.startswith("ros2") for each in storage.channels)
    except Exception:  # a damaged file: the reader of logs names the damage
        return False


class Recording:
    """An open bag. Messages are matched by topic and type; nothing else about a channel decides.

    Attributes:
        channels: Of all files; a topic has one for every publisher, type or definition.
        differences: Of the bag from its own statements, in words; complete after `messages`.

    Args:
        path: Folder, or a single storage file. All storage files of a folder belong to the bag, in or out of its
            metadata.

    Raises:
        ConfigError: When it cannot be read, or has no storage file.
    """

    def __init__(self, path: Path) -> None:
        typestore()  # names the extra where it is missing
        self._path, self._stack, self.differences = path, contextlib.ExitStack(), list[str]()
        self._storages = []
        with self._one_line():
            metadata = self._metadata() if path.is_dir() else {}
            for file in self._files(metadata) if path.is_dir() else [path]:
                storage = open_storage(file)
                self._stack.callback(storage.close)
                self._storages.append(storage)
                if storage.damage:
                    self.differences.append(f"{file.name}: {storage.damage}; it was read up to there")
        self.channels = [channel for storage in self._storages for channel in storage.channels]
        self._counts = _counts(metadata)

    def close(self) -> None:
        """Close every file."""
        self._stack.close()

    def messages(self, topics: set[str]) -> Iterator[Recorded]:
        """Messages of some topics in the order of recording."""
        read = [Counter[str]() for _ in self._storages]
        with self._one_line():
            streams = (_counted(each, topics, counts) for each, counts in zip(self._storages, read, strict=True))
            for message in heapq.merge(*streams, key=lambda each: each[0]):
                yield message._replace(data=unpacked(message.data))
        whole = sum(read, Counter[str]())
        stated = [("the file", each.stated, counts) for each, counts in zip(self._storages, read, strict=True)]
        for source, promised, counts in [*stated, (METADATA, self._counts, whole)]:
            self.differences += [
                f"{topic}: {source} states {promised[topic]} messages, {counts[topic]} were read"
                for topic in sorted(topics)
                if promised and promised[topic] != counts[topic]
            ]
        self.differences += [text for each in self._storages for text in each.damages.values()]

    def decode(self, message: Recorded) -> Any:
        """Decode a message by the definition of its channel, or by ours where it has none that can be used.

        Raises:
            Exception: Of the decoder, for bytes that are no message of the type.
        """
        return _decoder(*message.channel[1:])(message.data)

    @contextlib.contextmanager
    def _one_line(self) -> Iterator[None]:
        """Any error of a library becomes a ConfigError of one line, and closes the bag."""
        try:
            yield
        except Exception as error:
            self.close()
            if isinstance(error, UnreadableFile) and not self._path.exists():
                raise ConfigError(str(error)) from None
            reason = str(getattr(error, "reason", "")) or f"{type(error).__name__}: {error}"
            text = f"{self._path} is no readable ROS 2 bag ({shown(' '.join(reason.split()))[1:-1]})"
            raise ConfigError(text) from None

    def _metadata(self) -> dict[str, Any]:
        """Facts of the metadata; empty, and a difference, where they cannot be read."""
        from ruamel.yaml import YAML

        if not (self._path / METADATA).exists():
            return {}
        try:
            table = YAML(typ="safe").load(read_bytes(self._path / METADATA, LARGEST_METADATA))
            facts = table["rosbag2_bagfile_information"]
            return facts if isinstance(facts, dict) else {}
        except Exception:
            self.differences.append(f"{METADATA} is damaged; its counts are not compared")
            return {}

    def _files(self, metadata: dict[str, Any]) -> list[Path]:
        """Storage files of a folder: those of the metadata first."""
        listed = metadata.get("relative_file_paths")
        names = [Path(name).name for name in listed if isinstance(name, str)] if isinstance(listed, list) else []
        beside = sorted(each.name for each in self._path.iterdir() if each.name.endswith(ENDINGS) and each.is_file())
        for name in names:
            if name not in beside:
                self.differences.append(f"{name} of {METADATA} is missing")
        if names and (more := [name for name in beside if name not in names]):
            self.differences.append(f"{', '.join(more)}: not in {METADATA}, read as well")
        found = [self._path / name for name in dict.fromkeys((*names, *beside)) if name in beside]
        if not found:
            raise UnreadableFile(self._path, f"it has no file {', '.join(ENDINGS[:2])}")
        return found


def _counted(storage: McapStorage | SqliteStorage, topics: set[str], counts: Counter[str]) -> Iterator[Recorded]:
    """Messages of a file, counted."""
    for message in storage.messages(topics):
        counts[message.channel.topic] += 1
        yield message


def _counts(metadata: dict[str, Any]) -> Counter[str]:
    """Messages of each topic by the metadata."""
    counts = Counter[str]()
    try:
        for each in metadata.get("topics_with_message_count") or ():
            if isinstance(name := each["topic_metadata"]["name"], str):
                counts[name] += int(each["message_count"])
    except (TypeError, KeyError, ValueError, OverflowError):
        return Counter()
    return counts


@functools.lru_cache(maxsize=64)
def _decoder(name: str, form: str, definition: str) -> Callable[[bytes], Any]:
    from rosbags.typesys import Stores, get_typestore

    ours = typestore()
    try:
        types = {**ours.fielddefs, **_defined(name, form, definition)}
        store = get_typestore(Stores.EMPTY)
        store.register({each: types[each] for each in _needed(types, name)})
    except Exception:  # a definition without use spoils nothing but itself
        store = ours
    store.max_sequence_length = MOST_ENTRIES
    return lambda data: store.deserialize_cdr(data, name)


def _defined(name: str, form: str, definition: str) -> dict[str, Any]:
    """Types of a channel's definition, by name."""
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    if form == "ros2msg":
        return dict(get_types_from_msg(definition, name))
    found: dict[str, Any] = {}
    if form == "ros2idl":
        rule = "=" * 80 + "\n"
        parts = [part.split("\n", 1)[-1] for part in definition.split(rule) if part.startswith("IDL: ")]
        for part in parts or [definition]:
            found |= get_types_from_idl(part)
    return found


def _needed(types: dict[str, Any], name: str) -> set[str]:
    """A type and all types of its fields."""
    from rosbags.interfaces import Nodetype

    found, open_names = set[str](), [name]
    while open_names:
        if (each := open_names.pop()) in found:
            continue
        found.add(each)
        for _, (kind, details) in types[each][1]:
            inner = details[0] if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE) else (kind, details)
            if inner[0] == Nodetype.NAME:
                open_names.append(inner[1])
    return found
