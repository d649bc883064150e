"""The console script ``ibvs-qp``: parse the arguments, run a command, map every result to an exit code.

Exit codes: 0 flown and reported (also if a law did not complete), 1 internal error, 2 an error that the user can
correct (one line on standard error), 130 Ctrl-C and 143 SIGTERM with the partial run written.
"""

from __future__ import annotations

import contextlib
import difflib
import errno
import io
import itertools
import os
import re
import sys
import traceback
from collections.abc import Iterator
from typing import Protocol

import ibvs_qp
from ibvs_qp.config.errors import ConfigError, IbvsQpError, shown
from sim.commands.exit_codes import EXIT_INTERNAL, EXIT_INTERRUPTED, EXIT_TERMINATED, EXIT_USER
from sim.flight.stop import sigterm_as_ctrl_c
from sim.storage.limits import LONGEST_SIDE


def prepare_streams() -> None:
    """A closed stream becomes the null device, so that no file gets its number; output never fails for a character."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def drop_output() -> None:
    """Discard output that cannot be written, or the interpreter would try again at its end, and print a traceback."""
    try:
        sys.stdout.flush()
    except OSError:
        with open(os.devnull, "wb") as nothing:
            os.dup2(nothing.fileno(), sys.stdout.fileno())


@contextlib.contextmanager
def own_output() -> Iterator[None]:
    """Keep standard output for Python's own writes: C libraries write to standard error meanwhile.

    OSQP prints "Solver interrupted" after Ctrl-C, which would stand before the line of JSON.
    """
    if sys.stdout is not sys.__stdout__ or sys.stdout.fileno() != 1:
        yield  # redirected already
        return
    sys.stdout.flush()
    copy = os.dup(1)
    os.dup2(2, 1)
    sys.stdout = os.fdopen(copy, "w", encoding=sys.stdout.encoding, errors=sys.stdout.errors)
    try:
        yield
        sys.stdout.flush()
    finally:
        os.dup2(copy, 1)
        with contextlib.suppress(OSError):
            sys.stdout.close()
        sys.stdout = sys.__stdout__


#: Environment of the libraries, read when they load. One thread each: the matrices are small, and flights run side by
#: side as processes. OpenCV decodes no picture larger than `detect` takes, for any claim of a small file.
_ENVIRONMENT = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OPENCV_IO_MAX_IMAGE_PIXELS": str(LONGEST_SIDE**2),
}

#: Errors of the system, not of the program: full disk or quota, file too large, read-only, no permission, broken disk,
#: a name too long, a loop of links, a file for a folder or the reverse, a file that is gone, a reader that has left.
_SYSTEM_ERRORS = (
    errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO, errno.ENAMETOOLONG,
    errno.ELOOP, errno.ENOTDIR, errno.EISDIR, errno.ENOENT, errno.EEXIST, errno.EPIPE,
)  # fmt: skip
#: Longest message [characters].
_LONGEST = 1000
#: Colours and frames in messages of the parser.
_DECORATION = re.compile(r"\x1b\[[0-9;]*m|[\u2500-\u257f]")


class Command(Protocol):
    """Options of one command, filled in by the parser."""

    def run(self, words: list[str]) -> int:
        """Run the command.

        Args:
            words: Arguments after ``ibvs-qp``, for the record.

        Returns:
            The exit code.

        Raises:
            IbvsQpError: If an option, a file or a folder cannot be used.
        """
        ...


def main(arguments: list[str] | None = None) -> int:
    """Run ``ibvs-qp``.

    Args:
        arguments: Arguments after the program's name; None reads those of the process.

    Returns:
        The exit code.
    """
    for variable, value in _ENVIRONMENT.items():
        os.environ.setdefault(variable, value)
    if os.name != "posix":  # signals, owners of files and folders, atomic renames
        return _user_error(f"{sys.platform} is not supported; Linux and macOS are")
    prepare_streams()
    with sigterm_as_ctrl_c() as terminated:
        code = _run(sys.argv[1:] if arguments is None else arguments)
    return EXIT_TERMINATED if code == EXIT_INTERRUPTED and terminated() else code


def _run(words: list[str]) -> int:
    """Run one command and map its result to an exit code."""
    try:
        _check_text(words)
        with own_output() if "--json" in words else contextlib.nullcontext():
            code = _code(words)
        sys.stdout.flush()  # here, not at the end of the process: a full disk or a reader that left has a message
        return code
    except IbvsQpError as error:
        return _user_error(str(error))
    except OSError as error:
        if error.errno not in _SYSTEM_ERRORS:
            return _internal_error()
        drop_output()
        return _user_error(f"{error.filename or 'the disk or the output'}: {error.strerror}")
    except MemoryError:
        return _user_error("not enough memory")
    except ModuleNotFoundError as error:
        package = (error.name or "").split(".")[0]
        if package == "polars":
            return _user_error(f"{words[0]} needs the extra studies: pip install -c constraints.txt -e '.[studies]'")
        if package in ("", "allocation", "ibvs_qp", "sim"):
            return _internal_error()
        whole = "pip install -c constraints.txt -e ."
        return _user_error(f"{package} is not installed; ibvs-qp needs the whole installation: {whole}")
    except KeyboardInterrupt:
        print("ibvs-qp: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except Exception:
        return _internal_error()


def _code(words: list[str]) -> int:
    """Exit code of a command, also of one that ends while its arguments are parsed."""
    try:
        return _parse(words).run(words)
    except SystemExit as stop:
        if isinstance(stop.__context__, BrokenPipeError):  # Rich ends the program when the reader has left
            raise stop.__context__ from None
        return stop.code if isinstance(stop.code, int) else 0


def _internal_error() -> int:
    traceback.print_exc()
    print("ibvs-qp: internal error; please report it with the lines above", file=sys.stderr)
    return EXIT_INTERNAL


def _check_text(words: list[str]) -> None:
    """Raise ConfigError for an argument that no file of a run can repeat, and no file can be named."""
    for word in words:
        if "\0" in word or word != word.encode(errors="replace").decode():
            raise ConfigError(f"the argument {shown(word)} is refused: it must be UTF-8 text without zero bytes")


def _commands() -> dict[str, type[Command]]:
    from sim.commands.bench import Bench
    from sim.commands.bridge import BridgeCommand
    from sim.commands.compare import Compare
    from sim.commands.detect import Detect
    from sim.commands.experiment import ExperimentCommand
    from sim.commands.explain import Explain
    from sim.commands.export_c import ExportC
    from sim.commands.faults import Faults
    from sim.commands.live import Live
    from sim.commands.paint import Paint
    from sim.commands.replay import ReplayCommand
    from sim.commands.sweep import Sweep
    from sim.commands.tune import Tune
    from sim.commands.vehicle import Vehicle

    return {
        "paint": Paint,
        "bench": Bench,
        "experiment": ExperimentCommand,
        "compare": Compare,
        "detect": Detect,
        "explain": Explain,
        "sweep": Sweep,
        "tune": Tune,
        "faults": Faults,
        "vehicle": Vehicle,
        "export-c": ExportC,
        "bridge": BridgeCommand,
        "replay": ReplayCommand,
        "live": Live,
    }


def _parse(words: list[str]) -> Command:
    """Parse the arguments; an error of the parser becomes one line on standard error."""
    if words[:1] == ["--version"]:
        print(f"ibvs-qp {ibvs_qp.__version__}")
        raise SystemExit(0)
    import tyro

    commands = _commands()
    if words and not words[0].startswith("-") and words[0] not in commands:
        near = difflib.get_close_matches(words[0], commands, n=1)
        hint = f"did you mean {near[0]}?" if near else f"commands are {', '.join(commands)}"
        raise SystemExit(_user_error(f"unknown command {words[0]}; {hint}"))
    message = io.StringIO()
    try:
        with contextlib.redirect_stderr(message):
            return tyro.extras.subcommand_cli_from_dict(
                commands,
                prog="ibvs-qp",
                description="Aerial manipulation by one quadratic program per tick. Example: ibvs-qp paint",
                args=words,
                config=(tyro.conf.FlagCreatePairsOff,),
            )
    except SystemExit as stop:
        if not stop.code:
            raise
        command = " ".join(["ibvs-qp", *(word for word in words[:1] if word in commands)])
        raise SystemExit(_user_error(f"{_one_line(message.getvalue())} (see {command} --help)")) from None


def _one_line(text: str) -> str:
    """Message of the parser as one line, without frames and colours."""
    lines = [_DECORATION.sub("", line).strip() for line in text.splitlines()]
    # The first line is a title; an empty line separates the message from advice that repeats the help.
    body = list(itertools.takewhile(bool, lines[1:]))
    near = next((lines[i + 1 :] for i, line in enumerate(lines) if line.startswith("Perhaps you meant")), [])
    option = next((line.split()[0] for line in near if line), None)
    text = re.sub(r"'None', |, 'None'", "", " ".join(body))  # the default of an option that is not given
    return text + (f"; did you mean {option}?" if option else "")


def _user_error(message: str) -> int:
    line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in " ".join(message.split()))
    with contextlib.suppress(OSError):  # standard error may be on the full disk
        print("ibvs-qp: error: " + (line if len(line) <= _LONGEST else f"{line[:_LONGEST]} ..."), file=sys.stderr)
    return EXIT_USER


if __name__ == "__main__":
    sys.exit(main())
