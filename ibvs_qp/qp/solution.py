"""An accepted solution, and the tolerances of its acceptance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ibvs_qp.command import Outcome

#: A row whose multiplier exceeds this is active [cost per unit of the row]. OSQP projects on the bounds, so a free row
#: has a multiplier of 1e-12 at most; where a row is just touched, its multiplier is uncertain by about `tolerance`
#: times the coupling between rows, 1e-4.
ACTIVE_MULTIPLIER = 1e-3
#: Largest violation of a hard row in a solved program [N of thrust]; thrusts are clipped to their bounds.
BOUND_SLIP = 1e-2
#: Largest violation of a row by a solution refined on the active set [N of thrust].
REFINED_SLIP = 1e-5


class Tried(NamedTuple):
    """OSQP's iterations and wall-clock time [s] on a program, whether or not its answer was accepted."""

    iterations: int
    seconds: float


@dataclass(slots=True)
class AcceptedSolution:
    """Thrusts within their bounds (n,), primal x, multipliers y, how they were found, and whether a row is active."""

    thrusts: np.ndarray
    x: np.ndarray
    y: np.ndarray
    outcome: Outcome
    iterations: int
    seconds: float
    limited: bool
