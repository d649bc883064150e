"""A folder that one process writes at a time."""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from ibvs_qp.config.errors import IbvsQpError


@contextlib.contextmanager
def locked_folder(path: Path) -> Iterator[None]:
    """Create a folder, check that it can be written, and hold its lock while the context is open.

    The lock belongs to this process: the system releases it with the process, however that ends. An empty folder is
    removed at the end.

    Raises:
        IbvsQpError: When the folder cannot be written, or another process holds it.
    """
    with contextlib.ExitStack() as stack:
        try:
            path.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
            stack.callback(os.close, descriptor)
            _lock(descriptor, path)
            probe = path / f".write-test-{os.getpid()}"
            probe.write_bytes(b"")
            probe.unlink()
        except OSError as error:
            reason = error.strerror or str(error)
            raise IbvsQpError(f"cannot write run folder {path}: {reason}; give a writable folder with --out") from None
        try:
            yield
        finally:
            with contextlib.suppress(OSError):  # not empty, or gone
                path.rmdir()


def _lock(descriptor: int, path: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise IbvsQpError(f"run folder {path} is in use by another process; give another folder with --out") from None
    except OSError:
        return  # a file system without locks, as some of networks
