"""Files that no reader should trust: special, damaged, too large, too deep; made in a folder by name."""

from __future__ import annotations

import io
import os
import socket
import zipfile
from pathlib import Path

import numpy as np

#: A size that no reader takes [bytes]; the files are sparse and need no disk.
HUGE = 1 << 40
#: TOML, by name.
TOML = {
    "nested lists": "a = " + "[" * 5000 + "]" * 5000,
    "nested tables": "a = " + "{a = " * 5000 + "1" + "}" * 5000,
    "dotted key": ".".join(["a"] * 200_000) + " = 1",
    "dotted header": "[" + ".".join(['"a"'] * 100_000) + "]",
    "400 digits": f"[wall]\nfriction = {'9' * 400}\n[controller]\ntick_s = {'9' * 400}\n",
    "5000 digits": f"[wall]\nfriction = {'9' * 5000}\n",
    "integer in a list": f"[paint]\ncolor = [{'9' * 400}, 0, 0]\n",
    "no table": "= [[",
    "empty key": '"" = 1\n',
}
#: Bytes, whatever they should be.
BYTES = {
    "UTF-16": "[wall]\nfriction = 0.3\n".encode("utf-16"),
    "zeros": bytes(1000),
    "random": np.random.default_rng(0).bytes(5000),
}
#: JSON, by name.
JSON = {
    "empty": "",
    "deep": "[" * 100_000 + "]" * 100_000,
    "deep object": '{"a":' * 100_000,
    "other": '{"schema": 1}',
    "list": "[1, 2]",
    "laws": '{"laws": {"qp": 3}, "seed": 1, "version": "1"}',
    "digits": '{"laws": {"qp": {"completed": true, "reason": "", "x": ' + "9" * 5000 + '}}, "seed": 1, "version": "1"}',
    "surrogate": '{"laws": {"\\ud800": {"completed": true, "reason": "\\ud800", "x": 1}}, "seed": 1, "version": "1"}',
    "text": "no JSON",
}


def special_files(folder: Path, suffix: str) -> dict[str, Path]:
    """A device, a pipe, a socket, a folder, a dangling link, a missing and a huge file, all with a suffix."""
    names = ("device", "terminal", "pipe", "socket", "folder", "loop", "missing", "huge")
    found = {name: folder / f"{name}{suffix}" for name in names}
    found["device"].symlink_to("/dev/zero")
    found["terminal"].symlink_to("/dev/tty")
    os.mkfifo(found["pipe"])
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(found["socket"]))
    found["folder"].mkdir()
    found["loop"].symlink_to(found["loop"])
    found["huge"].touch()
    os.truncate(found["huge"], HUGE)
    return found


def npy(header: str, data: bytes = b"", version: tuple[int, int] = (1, 0)) -> bytes:
    """An npy file with a header of one's own."""
    text = header.encode() + b"\n"
    return b"\x93NUMPY" + bytes(version) + len(text).to_bytes(2, "little") + text + data


def npz(members: dict[str, bytes]) -> bytes:
    """An npz file of such members."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return stream.getvalue()


def header(shape: object, descr: str = "<f8") -> str:
    """Header of an npy file."""
    return repr({"descr": descr, "fortran_order": False, "shape": shape})


#: npy files whose header lies, or whose elements are no numbers.
NPY = {
    "huge shape": npy(header((10**12,)), bytes(80)),
    "overflowing shape": npy(header((2**33, 2**33)), bytes(80)),
    "negative shape": npy(header((-1,)), bytes(80)),
    "short": npy(header((10,)), bytes(79)),
    "long": npy(header((10,)), bytes(81)),
    "objects": npy(header((1,), "|O"), b"cos\nsystem\n(S'false'\ntR."),
    "no size": npy(header((10**9,), "<U0")),
    "records": npy(header((1,), "<M8[ns]"), bytes(8)),
    "no header": npy("{", bytes(8)),
    "code as header": npy("__import__('os').abort()", bytes(8)),
    "deep header": npy("(" * 5000 + ")" * 5000),
    "version": npy(header((1,)), bytes(8), (9, 9)),
}
