"""Limits inside the program against clipping after it: pushes near and beyond the reach."""

from __future__ import annotations

import numpy as np
import polars as pl

from sim.evaluate.table import markdown
from sim.experiments.wording import rounded
from sim.sweep.parts import PARAM
from sim.sweep.statistics import select

#: Pushes compared [N].
FROM_N, TO_N = 25.0, 35.0
#: Law and variant of each rival; none of them reduces the commanded push.
_QP = "the QP with its limits"
_RIVALS = {
    _QP: ("qp", "no-reach-check"),
    "the QP's thrusts clipped afterwards": ("qp", "clipped"),
    "the analytic law with clipping": ("paper", "no-reach-check"),
}
#: Metrics shown: metric, heading, factor, decimals; the first ranks the rivals.
_METRICS = (
    ("force_error_rms_n", "push minus command, rms [N]", 1.0, 2),
    ("height_error_peak_m", "height error, peak [mm]", 1e3, 1),
    ("tilt_peak_deg", "tilt, peak [deg]", 1.0, 2),
)
#: Decimals to which equal push errors are a tie [N].
_TIE_DIGITS = 1


def clipping(table: pl.DataFrame) -> str:
    """A table of the three rivals per push, and the winner, from the rows of ``saturation``; empty without them."""
    rows = table.filter((pl.col(PARAM + "kind") == "static") & pl.col(PARAM + "push_n").is_between(FROM_N, TO_N))
    friction = rows.filter(pl.col("variant") == "clipped")[PARAM + "friction"].unique()
    rows = rows.filter(pl.col(PARAM + "friction").is_in(friction.to_list()))
    lines, sentences = [], []
    for push in sorted(set(rows[PARAM + "push_n"])):
        scores = {}
        for words, (law, variant) in _RIVALS.items():
            part = select(rows, law=law, variant=variant, push_n=push)
            if not part.height:
                continue
            done = part.filter(pl.col("completed"))
            medians = [_median(done, metric) for metric, *_ in _METRICS]
            shown = [
                rounded(scale * value, digits) for value, (*_, scale, digits) in zip(medians, _METRICS, strict=True)
            ]
            lines.append([f"{push:g}", words, f"{done.height} of {part.height}", *shown])
            failed, error = 1.0 - done.height / part.height, medians[0]
            scores[words] = (failed, round(error, _TIE_DIGITS) if np.isfinite(error) else np.inf)
        if len(scores) > 1:
            sentences.append(f"- {push:g} N: {_winner(scores)}.\n")
    if not sentences:
        return ""
    heads = ("command [N]", "law", "done", *(heading for _, heading, *_ in _METRICS))
    return (
        f"Static pushes of {FROM_N:g} to {TO_N:g} N without the reach check, medians over the flights that ended as "
        "planned. Rank: flights that ended as planned, then push error:\n\n"
        + markdown(heads, lines)
        + "\n"
        + "".join(sentences)
    )


def _median(rows: pl.DataFrame, metric: str) -> float:
    known = rows[metric].drop_nulls().to_numpy() if metric in rows.columns else np.zeros(0)
    return float(np.median(known)) if known.size else np.nan


def _winner(scores: dict[str, tuple[float, float]]) -> str:
    """The best rival in words; scores are (ratio of failed flights, push error), less is better."""
    best = min(scores.values())
    winners = [words for words, score in scores.items() if score == best]
    if best[0] >= 1.0:
        return "no flight ends as planned"
    if _QP not in winners:
        outcome = f"clipping wins ({' and '.join(winners)})"
    else:
        outcome = f"{_QP} wins" if len(winners) == 1 else f"no difference ({' and '.join(winners)})"
    crashed = [words for words, (failed, _) in scores.items() if failed >= 1.0]
    return outcome + (f"; all flights of {' and '.join(crashed)} fail" if crashed else "")
