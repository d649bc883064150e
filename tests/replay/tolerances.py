"""By how much a replay may differ from the reference outputs: the one table for test and command.

A step of work that is meant to change commands changes it here, with the reason.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Allowed difference: ``free`` or ``limited``, plus ``relative`` times the reference value.

    Attributes:
        free: On ticks without an active limit.
        limited: On ticks at which, or just before which, a limit was active in the reference; None as on the others.
        relative: Times the magnitude of the reference.
    """

    free: float = 0.0
    limited: float | None = None
    relative: float = 0.0


#: The same machine repeats every bit (``python -m tests.replay.compare --exact``). Another processor adds in another
#: order: 2e-8 N, largest in the octorotor's redundant thrusts, which little weight holds. Without a C compiler vision
#: differs by 1e-8, which makes 2e-7 N. The bounds leave a factor of five to ten.
TOLERANCES = {
    "thrusts": Tolerance(free=1e-6, limited=1e-6),  # N
    "P": Tolerance(free=1e-5, relative=1e-8),  # cost per N^2; 40000 for a slack
    "q": Tolerance(free=5e-4, relative=1e-8),  # cost per N; up to 7000
    "A": Tolerance(free=1e-7, relative=1e-8),  # unit of the row per N
    "l": Tolerance(free=1e-6, relative=1e-8),  # unit of the row; thrusts of the tick before enter here
    "u": Tolerance(free=1e-6, relative=1e-8),
    "percept_plane": Tolerance(free=1e-9),  # 1/m
    "percept_velocity": Tolerance(free=1e-9),  # m/s
    "percept_velocity_covariance": Tolerance(free=1e-12, relative=1e-8),
    "percept_line_rho": Tolerance(free=1e-7),
    "percept_line_theta": Tolerance(free=1e-7),  # rad
    "percept_line_covariance": Tolerance(free=2e-11, relative=1e-6),
    "percept_line_segment": Tolerance(free=1e-7),
    "percept_line_weight": Tolerance(free=1e-9),
}

#: Texts (outcome, mode, rejected, active_limits) and whole numbers that may differ: entries; all others must be equal.
MAY_DIFFER = {"outcome": 0, "mode": 0, "rejected": 0, "active_limits": 0}
