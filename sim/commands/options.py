"""What the options of several commands share: how help shows them, their checks, and the command that goes on."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tyro

#: Help text of a switch: it is off where it is not given, and help need not say so.
flag = tyro.conf.arg(help_behavior_hint="")


def optional(metavar: str) -> Any:
    """Help text of an option whose default is worded in its description."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


def check_count(option: str, value: int | None) -> None:
    """Refuse a count below one; None is the command's own choice.

    Raises:
        ConfigError: Names the option, the value and what is allowed.
    """
    from ibvs_qp.config.errors import out_of_range

    if value is not None and value < 1:
        raise out_of_range(option, value, "", "allowed are 1, 2, 3, ...")


def go_on(words: Sequence[str], folder: Path) -> str:
    """The command that goes on where this one stopped: the same, in the same folder.

    Args:
        words: What was given after ``ibvs-qp``.
        folder: Where the results are.
    """
    given = any(word.split("=")[0] == "--out" for word in words)
    return shlex.join(["ibvs-qp", *words, *([] if given else ["--out", str(folder)])])
