"""The race as a markdown table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.notebook.solvers.race import Result


def race_table(results: Sequence[Result], reference: str = "shipped") -> str:
    """Times over those of one contender, errors in newtons, fastest median first.

    Args:
        results: Of one race.
        reference: Name of the contender that times are divided by.
    """
    base = next((float(np.median(one.times_us)) for one in results if one.contender.name == reference), float("nan"))
    lines = [
        f"| solver | median time, {reference} = 1 | 99 % of ticks within | error, median [N] | error, 99 % [N] | "
        "iterations, median / most | no answer |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for one in sorted(results, key=lambda each: float(np.median(each.times_us))):
        middle, slow = (float(np.percentile(one.times_us, share)) / base for share in (50.0, 99.0))
        errors = [float(np.nanpercentile(one.errors_n, share)) for share in (50.0, 99.0)]
        counts = f"{np.median(one.iterations):.0f} / {one.iterations.max()}" if one.iterations.any() else "–"
        lines.append(
            f"| {one.contender.name} | {middle:.2f} | {slow:.2f} | {errors[0]:.1e} | {errors[1]:.1e} | {counts} | "
            f"{one.unanswered} |"
        )
    return "\n".join(lines)
