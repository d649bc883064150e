"""Short form in which the tests run every notebook: the same cells with shorter flights and smaller grids."""

from __future__ import annotations

import os
from typing import TypeVar

T = TypeVar("T")

#: Environment variable that selects the short form; any non-empty text does.
SHORT_VARIABLE = "IBVS_QP_NOTEBOOKS_SHORT"


def unless_short(full: T, short: T) -> T:
    """Return `full` for a reader and `short` for a test."""
    return short if os.environ.get(SHORT_VARIABLE) else full
