"""M of the contract: the figures of one flight and of its rows, from its trace alone."""

from __future__ import annotations

from typing import Any

from sim.evaluate.figures import figures_of
from sim.evaluate.part import Part
from sim.flight.trace import Trace


def compute_metrics(trace: Trace) -> dict[str, Any]:
    """Compute M of the contract.

    Args:
        trace: One flight, complete or not.

    Returns:
        The figures by name, and those of every row flown under ``rows``; a figure without data is NaN.
    """
    whole = Part.whole(trace)
    return figures_of(whole) | {"rows": [{"row": row.row, **figures_of(row)} for row in whole.rows()]}
