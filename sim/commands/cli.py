"""The console script ``ibvs-qp``: parse, run a command, and turn every outcome into an exit code.

Exit codes: 0 flown and reported (also if a law did not complete), 1 internal error, 2 an error that the user can
mend (one line on standard error), 130 Ctrl-C with the partial run written.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import os
import re
import sys
import traceback
from typing import Any

from ibvs_qp.config.errors import IbvsQpError

#: Commands by name, for hints.
COMMANDS = ("paint", "experiment", "compare", "explain", "bench", "detect", "sweep", "tune")
EXIT_INTERNAL, EXIT_USER, EXIT_INTERRUPTED = 1, 2, 130

#: One thread each: the matrices are small, and the laws and their repeats share the cores as processes.
_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

_BOXES = re.compile(r"\x1b\[[0-9;]*m|[\u2500-\u257f]")


def main(arguments: list[str] | None = None) -> int:
    """Run ``ibvs-qp``.

    Args:
        arguments: Words after the program's name; None takes those of the process.

    Returns:
        The exit code.
    """
    for variable in _THREAD_VARIABLES:
        os.environ.setdefault(variable, "1")
    words = sys.argv[1:] if arguments is None else arguments
    try:
        return _parse(words).run(words)
    except IbvsQpError as error:
        return _refuse(str(error))
    except KeyboardInterrupt:
        print("ibvs-qp: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 0
    except Exception:
        traceback.print_exc()
        print("ibvs-qp: internal error; please report it with the lines above", file=sys.stderr)
        return EXIT_INTERNAL


def _parse(words: list[str]) -> Any:
    """Turn words into the options of a command; the parser's own complaint becomes one line."""
    import tyro

    from sim.commands.bench import Bench
    from sim.commands.compare import Compare
    from sim.commands.detect import Detect
    from sim.commands.experiment import ExperimentCommand
    from sim.commands.explain import Explain
    from sim.commands.paint import Paint
    from sim.commands.sweep import Sweep
    from sim.commands.tune import Tune

    app = tyro.extras.SubcommandApp()
    app.command(name="paint")(Paint)
    app.command(name="bench")(Bench)
    app.command(name="experiment")(ExperimentCommand)
    app.command(name="compare")(Compare)
    app.command(name="detect")(Detect)
    app.command(name="explain")(Explain)
    app.command(name="sweep")(Sweep)
    app.command(name="tune")(Tune)
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            return app.cli(
                prog="ibvs-qp",
                description="Aerial manipulation by one quadratic program per tick. Example: ibvs-qp paint",
                args=words,
                config=(tyro.conf.FlagCreatePairsOff,),
            )
    except SystemExit as stop:
        if stop.code:
            raise SystemExit(_refuse(_one_line(complaint.getvalue()), words)) from None
        raise


def _one_line(text: str) -> str:
    """Strip frames and colours from the parser's message and keep what it says, as one line."""
    lines = [_BOXES.sub("", line).strip() for line in text.splitlines()]
    # The first line is a title; rulers, by now empty, part the complaint from advice that repeats the help.
    body = list(itertools.takewhile(bool, lines[1:]))
    near = next((lines[i + 1 :] for i, line in enumerate(lines) if line.startswith("Perhaps you meant")), [])
    option = next((line.split()[0] for line in near if line), None)
    return " ".join(body) + (f"; did you mean {option}?" if option else "")


def _refuse(message: str, words: list[str] | None = None) -> int:
    hint = ""
    if words is not None:
        command = " ".join(["ibvs-qp", *[word for word in words[:1] if word in COMMANDS]])
        hint = f" (see {command} --help)"
    print("ibvs-qp: error: " + " ".join(message.split()) + hint, file=sys.stderr)
    return EXIT_USER


if __name__ == "__main__":
    sys.exit(main())
