"""Impedance against direct force control, from the experiment with variants that differ in nothing else."""

from __future__ import annotations

from collections import Counter

import polars as pl

from sim.experiments.figures.force_map import OSCILLATES_N, map_cells
from sim.experiments.relevance import Effect, effect
from sim.experiments.sections import capped
from sim.experiments.spec import Column, Experiment
from sim.experiments.wording import cell, exact, rounded, varying
from sim.flight.trace import law_name
from sim.sweep.paired import variant_differences
from sim.sweep.parts import PARAM
from sim.sweep.statistics import completed, median_interval, select

#: Variants: impedance and direct force control; their metric.
IMPEDANCE, DIRECT, _METRIC = "standard", "direct", "force_rms_n"
_PAPER = "The paper reports the opposite: on its hardware direct force control oscillated and crashed."
#: Printed only if direct control is steadier at the shipped gains and less stable beyond them.
_MECHANISM = (
    "Mechanism: impedance damps the closing rate, whose estimate carries the accelerometer's noise into the push "
    "(without that noise, impedance is as steady as direct control); the same damping is missing from direct control "
    "where gain, stiffness or delay of the sensor grow."
)


def impedance_section(experiment: Experiment, table: pl.DataFrame) -> str:
    """The verdict at the shipped gains, stability over the map, and push errors per cell; empty without both."""
    found = [
        entry
        for entry in variant_differences(table, {DIRECT: (IMPEDANCE,)}, [_METRIC])
        if not experiment.is_folded(entry["params"])
    ]
    if not found:
        return ""
    column = next(each for each in experiment.columns if each.metric == _METRIC)
    effects: Counter[Effect] = Counter()
    rows = []
    for entry, place in zip(found, varying([entry["params"] for entry in found]), strict=True):
        difference = entry["differences"].get(_METRIC)
        if difference and entry["params"].get("kind") == "hold":
            effects[effect(difference, column)] += 1
        own = select(table, entry["params"], law=entry["law"])
        medians = (_median(select(own, variant=name), column) for name in (IMPEDANCE, DIRECT))
        done = " and ".join(str(entry["flown"] - failed) for failed in entry["failed"]) + f" of {entry['flown']}"
        where = cell(experiment, place) or "all"
        rows.append([law_name(entry["law"]), where, done, *medians, exact(difference, column)])
    heads = ("law", "cell", "done", "impedance [N]", "direct [N]", "direct minus impedance [N]")
    stability, worse_beyond = _stability(table)
    steadier = effects[Effect.SECOND] > 0 and not effects[Effect.FIRST]
    mechanism = f" {_MECHANISM}" if steadier and worse_beyond else ""
    return f"{_described(effects)} {stability}{mechanism}\n\n{column.label.capitalize()}:\n\n{capped(heads, rows)}"


def _median(rows: pl.DataFrame, column: Column) -> str:
    return rounded(column.scale * median_interval(completed(rows, _METRIC))["median"], column.digits)


def _described(effects: Counter[Effect]) -> str:
    """The verdict in words."""
    cells, direct, impedance = sum(effects.values()), effects[Effect.SECOND], effects[Effect.FIRST]
    if cells == effects[Effect.FEW]:
        return "Too few pairs for a verdict at the shipped gains."
    if direct and not impedance:
        return (
            f"**At the shipped gains direct force control is steadier than impedance**, in {direct} of {cells} "
            f"cells. {_PAPER}"
        )
    if impedance and not direct:
        return (
            f"**At the shipped gains impedance is steadier than direct force control**, in {impedance} of "
            f"{cells} cells."
        )
    if not direct:
        return f"**No difference that matters at the shipped gains**, in {cells} cells. {_PAPER}"
    return f"**Mixed at the shipped gains**: of {cells} cells direct is steadier in {direct}, impedance in {impedance}."


def _stability(table: pl.DataFrame) -> tuple[str, bool]:
    """Cells of the map that oscillate, in words, and whether direct control does only beyond the shipped gains."""
    flown = select(table, kind="map")
    if not flown.height:
        return "", False
    cells = map_cells(flown)
    parts, count = [], {}
    for variant, words in ((IMPEDANCE, "impedance"), (DIRECT, "direct control")):
        unstable = cells.filter((pl.col("variant") == variant) & pl.col("unstable"))
        count[variant] = unstable.height
        gains = unstable[PARAM + "force_gain"]
        least = f" (from {gains.min():g} times the shipped force gain on)" if gains.len() else ""
        total = cells.filter(pl.col("variant") == variant).height
        parts.append(f"{unstable.height} of {total} cells with {words}{least}")
    shipped = cells.filter((pl.col("variant") == DIRECT) & (pl.col(PARAM + "force_gain") == 1.0))
    text = (
        f"Over the map of force gain, wall and sensor delay, the push deviates by more than {OSCILLATES_N:g} N or "
        f"contact is lost in {' and '.join(parts)}."
    )
    return text, count[DIRECT] > count[IMPEDANCE] and not shipped["unstable"].any()
