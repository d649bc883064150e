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
#: order, and OSQP may stop five iterations earlier or later: that moves thrusts by 1e-5 N, or 1e-3 N where limits are
#: active. Gradient and bounds contain the thrusts of the tick before. Without a C compiler vision
#: differs by 1e-8, which makes 2e-7 N.
TOLERANCES = {
    "thrusts": Tolerance(free=1e-4, limited=5e-3),  # N
    "P": Tolerance(free=1e-5, relative=1e-8),  # cost per N^2; 40000 for a slack
    "q": Tolerance(free=0.05, limited=2.5, relative=1e-8),  # cost per N; up to 7000
    "A": Tolerance(free=1e-7, relative=1e-8),  # unit of the row per N
    "l": Tolerance(free=1e-4, limited=5e-3, relative=1e-8),  # unit of the row
    "u": Tolerance(free=1e-4, limited=5e-3, relative=1e-8),
    "percept_plane": Tolerance(free=1e-9),  # 1/m
    "percept_velocity": Tolerance(free=1e-9),  # m/s
    "percept_velocity_covariance": Tolerance(free=1e-12, relative=1e-8),
    "percept_line_rho": Tolerance(free=1e-7),
    "percept_line_theta": Tolerance(free=1e-7),  # rad
    "percept_line_covariance": Tolerance(free=2e-11, relative=1e-6),
    "percept_line_segment": Tolerance(free=1e-7),
    "percept_line_weight": Tolerance(free=1e-9),
}

#: Cases whose thrusts, gradients and bounds may differ by a multiple. Smoothness alone holds some thrust directions:
#: the octorotor's without wrench, and those without a task after a rotor loss. Open loop, what a tick adds there stays.
MULTIPLES = {"rotor_loss": 10.0, "broken_inputs": 10.0, "octorotor": 100.0}

#: Texts (outcome, mode, rejected, active_limits) and whole numbers that may differ: entries; all others must be equal.
#: On limited ticks OSQP may stop at its cap: "inaccurate_accepted" or "exact_fallback" instead of "solved".
MAY_DIFFER = {"outcome": 40, "mode": 0, "rejected": 0, "active_limits": 0}


def tolerances_of(case: str) -> dict[str, Tolerance]:
    """The table with the multiples of a case."""
    multiple = MULTIPLES.get(case, 1.0)
    return TOLERANCES | {name: _times(TOLERANCES[name], multiple) for name in ("thrusts", "q", "l", "u")}


def _times(tolerance: Tolerance, multiple: float) -> Tolerance:
    limited = None if tolerance.limited is None else multiple * tolerance.limited
    return Tolerance(free=multiple * tolerance.free, limited=limited, relative=tolerance.relative)
