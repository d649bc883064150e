"""The system's C compiler: found, and run with a limit of time for the whole process."""

from __future__ import annotations

import functools
import logging
import os
import shlex
import shutil
import signal
import subprocess
import tempfile
import time

#: Time that compilers may take in one process [s], all runs together: a tick and its solver need 4 s on an idle core.
PATIENCE_S = 30.0

log = logging.getLogger(__name__)
_spent_s = 0.0


def compiler() -> list[str] | None:
    """The C compiler's command (``CC``, else cc), or None where there is none."""
    command = list(_words(os.environ.get("CC", "cc")))
    return command if os.name == "posix" and command and shutil.which(command[0]) else None


@functools.cache  # a command that is none is reported once, however many functions are translated
def _words(given: str) -> tuple[str, ...]:
    try:
        return tuple(shlex.split(given))
    except ValueError as error:
        log.warning("CC = %r is no command: %s", given, error)
        return ()


@functools.cache
def compiler_version(*command: str) -> bytes:
    """What a compiler tells of itself; raises as `run_compiler`."""
    return run_compiler([*command, "--version"])


def run_compiler(command: list[str]) -> bytes:
    """Standard output of one run.

    Raises:
        OSError: When it cannot be started, or the time of this process is used up: it and its children are killed.
        subprocess.SubprocessError: When it fails.
    """
    global _spent_s
    began = time.monotonic()
    # A file, not a pipe: a pipe stays open as long as any child of a killed compiler lives.
    with tempfile.TemporaryFile() as output:
        # The command is the user's own CC, split into words, without a shell.
        process = subprocess.Popen(  # nosec B603
            command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.DEVNULL, start_new_session=True
        )
        try:
            code = process.wait(max(PATIENCE_S - _spent_s, 0.0))
        except subprocess.TimeoutExpired:
            raise TimeoutError(f"{command[0]} is given {PATIENCE_S:g} s in all") from None
        finally:
            if process.returncode is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            _spent_s += time.monotonic() - began
        if code:
            raise subprocess.CalledProcessError(code, command)
        output.seek(0)
        return output.read()
