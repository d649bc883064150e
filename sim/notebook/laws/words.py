"""Short flights side by side as a markdown table."""

from __future__ import annotations

import math
from collections.abc import Mapping

from sim.flight.trace import Trace
from sim.notebook.laws.flights import task_figures

#: Figures of `task_figures` in words, with digits.
_ROWS = {
    "push_n": ("push, mean once settled [N]", 2),
    "push_error_n": ("push error, rms [N]", 2),
    "height_mm": ("greatest change of height [mm]", 1),
    "path_mm": ("path along the edge, rms [mm]", 1),
    "roll_deg": ("roll while sliding, mean [deg]", 2),
    "tilt_deg": ("tilt, peak [deg]", 2),
    "yaw_deg": ("yaw, peak [deg]", 2),
}


def flights_table(flights: Mapping[str, Trace], rows: tuple[str, ...]) -> str:
    """One column per flight.

    Args:
        flights: By name.
        rows: Keys of `task_figures` to show.
    """
    figures = {name: task_figures(trace) for name, trace in flights.items()}
    lines = ["| | " + " | ".join(flights) + " |", "|---|" + "---:|" * len(flights)]
    for key in rows:
        words, digits = _ROWS[key]
        values = (figures[name][key] for name in flights)
        lines.append(
            f"| {words} | " + " | ".join(f"{one:.{digits}f}" if math.isfinite(one) else "–" for one in values) + " |"
        )
    ends = " | ".join(trace.reason or "–" for trace in flights.values())
    return "\n".join([*lines, f"| end | {ends} |"])
