"""Published flights and rates of others with the figures of the worlds with the errors of a real vehicle."""

from __future__ import annotations

import numpy as np

from sim.evaluate.table import markdown
from sim.experiments.comparison import best_allocator, compared_cells
from sim.experiments.sections import Flown, world_of
from sim.experiments.wording import interval
from sim.sweep.statistics import completed, median_interval, select

#: Worlds whose figures are compared with real flights; those without errors would mislead.
_REALISTIC = ("datasheet", "harsh")
#: Metrics that were published.
_METRICS = ("path_rms_straight_m", "force_rms_straight_n")
#: Flights of others: vehicle, path, push.
_FLIGHTS = (
    ("real flight, another vehicle of this class: Guo, He et al., *Flying Calligrapher*, RA-L 2024", "29 mm", "0.7 N"),
    ("real flight, quadrotor with a delta arm and motion capture: Tzoumanikas et al., RSS 2020", "millimetres", "–"),
)
#: Pictures per second of the perception, and the variant that flies the paper's; its detection lacks the surface.
_RATE, _PAPER_VISION = "perception_hz", "paper-vision"


def published_section(flown: Flown) -> str:
    """Own simulated figures in the worlds with errors, and those of real flights; empty without such a world."""
    rows = []
    for experiment, table in flown:
        columns = [column for metric in _METRICS for column in experiment.columns if column.metric == metric]
        for _, params, qp, parts in compared_cells(experiment, table, ("standard",)):
            if world_of(params) not in _REALISTIC or len(columns) < len(_METRICS) or len(params) > 1:
                continue
            best = best_allocator(parts, columns[0])
            for law, flights in (("QP law", qp), (f"analytic law ({best})", parts[best])):
                values = [completed(flights, column.metric) for column in columns]
                cells = [
                    f"{interval(median_interval(each), column, len(each))} {column.unit}"
                    for each, column in zip(values, columns, strict=True)
                ]
                what = f"simulation, {experiment.name}, world *{world_of(params)}*, {law}"
                rows.append([what, *cells, f"{flights['completed'].sum()} of {flights.height}"])
    if not rows:
        return ""
    rows += [[*flight, "–"] for flight in _FLIGHTS]
    return (
        "Real flights with other vehicles, walls and jobs, next to simulated ones: they show the size of errors in "
        "practice, not who is better.\n\n" + markdown(("flight", "path, rms", "push error, rms", "flights done"), rows)
    )


def rates_section(flown: Flown) -> str:
    """Rates of perception and of the paper's line detection; empty without a flight that timed it."""
    rates = {
        variant: float(np.median(np.concatenate(values)))
        for variant in ("standard", _PAPER_VISION)
        if (
            values := [
                completed(select(table, law="qp", variant=variant), _RATE)
                for _, table in flown
                if _RATE in table.columns
            ]
        )
        and sum(map(len, values))
    }
    if "standard" not in rates:
        return ""
    other = f"; the paper's vision, re-made here: {rates[_PAPER_VISION]:.0f} Hz" if _PAPER_VISION in rates else ""
    return (
        "Line detection in the paper: 27 Hz on an i7, 12 Hz on a Jetson TX2. Whole perception here (surface, edges, "
        f"tracking; median picture of the QP flights, on the computer of the record): {rates['standard']:.0f} Hz"
        f"{other}. The computers differ, so these rates rank no method.\n"
    )
