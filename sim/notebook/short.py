"""The short form in which tests run every notebook: the same cells, less flying."""

from __future__ import annotations

import os
from typing import TypeVar

T = TypeVar("T")

#: Environment variable that asks for the short form; any text but the empty one does.
SHORT_VARIABLE = "IBVS_QP_NOTEBOOKS_SHORT"


def short_form() -> bool:
    """Whether notebooks run in their short form."""
    return bool(os.environ.get(SHORT_VARIABLE))


def unless_short(full: T, short: T) -> T:
    """One of two sizes of the same thing.

    Args:
        full: What a reader gets.
        short: What a test gets.
    """
    return short if short_form() else full
