"""What the table says, as markdown."""

from __future__ import annotations

import math
from typing import Any

import polars as pl

from sim.figures.style import law_name
from sim.notebook.noise.again import Again
from sim.notebook.noise.effects import averaged_samples, effects
from sim.notebook.noise.table import FIGURES, FORCE, VS, Figure, grid_of, reasons, success
from sim.sweep.paired import needed, paired_differences, sign

_PATH, _PUSH = FIGURES[:2]
#: By the sign of analytic law minus QP law in what shall be small.
_VERDICTS = {1: "QP better", 0: "no difference shown", -1: "analytic law better"}


def _number(value: float, digits: int = 2) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"


def success_table(table: pl.DataFrame) -> str:
    """Completed flights of each cell, and why the others were not."""
    sigmas, forces = grid_of(table)
    lines = ["| law | sigma_vs | " + " | ".join(f"sigma_f {force:g} N" for force in forces) + " |"]
    lines.append("|---|---:|" + "---:|" * len(forces))
    counts = {(row["law"], row[VS], row[FORCE]): row for row in success(table).to_dicts()}
    for law in ("qp", "paper"):
        for vs in sigmas:
            cells = (counts.get((law, vs, force)) for force in forces)
            words = (
                f"{cell['completed'] * cell['flights']:.0f} of {cell['flights']}" if cell else "–" for cell in cells
            )
            lines.append(f"| {law_name(law)} | {vs:g} | " + " | ".join(words) + " |")
    failed = "; ".join(f"{each['len']} × {law_name(each['law'])}: {each['reason']}" for each in reasons(table)[:6])
    return "\n".join(lines) + f"\n\nNot completed: {failed or 'none'}."


def effects_table(table: pl.DataFrame, figures: tuple[Figure, ...] = FIGURES[:2]) -> str:
    """Exponents and shares of the scatter per law and figure."""
    lines = [
        "| figure | law | flights | exponent of sigma_vs | exponent of sigma_f | explained by sigma_vs | by sigma_f | "
        "left to the seeds |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for figure in figures:
        for law in ("qp", "paper"):
            got = effects(table, law, figure)
            shares = (got.vs_share, got.force_share, got.rest_share)
            percent = " | ".join(f"{share:.0%}" if math.isfinite(share) else "–" for share in shares)
            powers = f"{_number(got.vs_exponent)} | {_number(got.force_exponent)}"
            lines.append(f"| {figure.words} | {law_name(law)} | {got.flights} | {powers} | {percent} |")
    return "\n".join(lines)


def averages_table(table: pl.DataFrame) -> str:
    """Samples that must have been averaged, per noise and law."""
    lines = ["| law | sigma_vs | pictures | sigma_f [N] | force samples |", "|---|---:|---:|---:|---:|"]
    for law in ("qp", "paper"):
        pictures, samples = averaged_samples(table, law, _PATH, _PUSH)
        for (vs, seen), (force, felt) in zip(pictures.items(), samples.items(), strict=False):
            lines.append(f"| {law_name(law)} | {vs:g} | {_number(seen, 0)} | {force:g} | {_number(felt, 0)} |")
    return "\n".join(lines)


def differences_table(table: pl.DataFrame, figure: Figure) -> str:
    """Analytic law minus QP law, seed by seed: median with its exact interval per cell."""
    lines = [f"| sigma_vs | sigma_f [N] | pairs | analytic − QP, {figure.words} | 95 % interval | |"]
    lines.append("|---:|---:|---:|---:|---:|---|")
    completed = table.filter(pl.col("completed"))
    for cell in paired_differences(completed, [figure.column]) if completed.height else []:
        found = cell["differences"].get(figure.column)
        if found is None:
            continue
        low, middle, high = (figure.scale * found[name] for name in ("sure_low", "median", "sure_high"))
        better = -sign(found) if figure.more_is_better else sign(found)
        verdict = _VERDICTS[better] if math.isfinite(low) else f"sure from {needed()} pairs on"
        span = f"{low:+.2f} to {high:+.2f}" if math.isfinite(low) else "–"
        params = cell["params"]
        lines.append(
            f"| {params['sigma_vs']:g} | {params['sigma_f_n']:g} | {cell['n']} | {middle:+.2f} | {span} | {verdict} |"
        )
    return "\n".join(lines)


def again_table(row: dict[str, Any], again: Again) -> str:
    """Figures of the table beside those of the flight flown again."""
    lines = ["| figure | in the table | flown again |", "|---|---:|---:|"]
    for figure in FIGURES[:4]:
        there, here = row.get(figure.column), again.figures.get(figure.column, math.nan)
        values = (math.nan if value is None else figure.scale * value for value in (there, here))
        lines.append(f"| {figure.words} | " + " | ".join(_number(value, 3) for value in values) + " |")
    note = (
        "Same code, same settings: the figures are the same to the bit."
        if again.same
        else "Code or settings have changed since the table was made, so the figures may differ."
    )
    return "\n".join([*lines, "", note])
