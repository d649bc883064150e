"""Where clipping wins and loses: pushes near the reach, limits inside the program against clipping after it."""

from __future__ import annotations

import numpy as np
import polars as pl

from sim.experiments.wording import markdown, rounded
from sim.sweep.parts import PARAM

#: Pushes between which clipping is compared [N].
FROM_N, TO_N = 25.0, 35.0
#: Who pushes, by law and variant: none of them reduces the asked push.
_RIVALS = {
    ("qp", "no-reach-check"): "the QP with its limits",
    ("qp", "clipped"): "the QP's thrusts clipped afterwards",
    ("paper", "no-reach-check"): "the analytic law with clipping",
}
#: Figures shown: metric, heading, factor, digits.
_FIGURES = (
    ("force_error_rms_n", "push minus asked, rms [N]", 1.0, 2),
    ("height_error_peak_m", "height error, peak [mm]", 1e3, 1),
    ("tilt_peak_deg", "tilt, peak [deg]", 1.0, 2),
)
#: Decimals to which two push errors count as equal [N].
_TIE_DIGITS = 1


def clipping(table: pl.DataFrame) -> str:
    """A table of the three rivals per push, and who wins, from the rows of ``saturation``; empty without them.

    Args:
        table: Rows of the experiment.
    """
    rows = table.filter((pl.col(PARAM + "kind") == "static") & pl.col(PARAM + "push_n").is_between(FROM_N, TO_N))
    friction = rows.filter(pl.col("variant") == "clipped")[PARAM + "friction"].unique()
    rows = rows.filter(pl.col(PARAM + "friction").is_in(friction.to_list()))
    lines, sentences = [], []
    for push in sorted(set(rows[PARAM + "push_n"])):
        scores = {}
        for (law, variant), words in _RIVALS.items():
            part = rows.filter(
                (pl.col(PARAM + "push_n") == push) & (pl.col("law") == law) & (pl.col("variant") == variant)
            )
            if part.height:
                done = part.filter(pl.col("completed"))
                middle = [_median(done, name) for name, *_ in _FIGURES]
                shown = [rounded(f * value, digits) for value, (*_, f, digits) in zip(middle, _FIGURES, strict=True)]
                lines.append([f"{push:g}", words, f"{done.height} of {part.height}", *shown])
                scores[words] = (1.0 - done.height / part.height, middle[0])
        if len(scores) > 1:
            sentences.append(_verdict(push, scores))
    if not sentences:
        return ""
    heads = ("asked [N]", "law", "done", *(heading for _, heading, *_ in _FIGURES))
    return (
        f"Static pushes of {FROM_N:g} to {TO_N:g} N without the reach check, medians over the flights that ended as "
        "planned. Ranked by flights that end as planned, then by how near the push is to the asked one:\n\n"
        + markdown(heads, lines)
        + "\n"
        + "\n".join(sentences)
        + "\n"
    )


def _median(rows: pl.DataFrame, name: str) -> float:
    known = rows[name].drop_nulls().to_numpy() if name in rows.columns else np.zeros(0)
    return float(np.median(known)) if known.size else np.nan


def _verdict(push: float, scores: dict[str, tuple[float, float]]) -> str:
    """Who does best at a push, in a sentence; scores are (share of failures, push error)."""

    def rank(words: str) -> tuple[float, float]:
        failed, error = scores[words]
        return failed, round(error, _TIE_DIGITS) if np.isfinite(error) else np.inf

    best = min(map(rank, scores))
    winners = [words for words in scores if rank(words) == best]
    ours = next(iter(_RIVALS.values()))
    if best[0] >= 1.0:
        return f"- {push:g} N: no law ends a flight as planned."
    if ours not in winners:
        fate = f"clipping wins ({' and '.join(winners)})"
    else:
        fate = "the QP with its limits wins" if len(winners) == 1 else f"no difference ({' and '.join(winners)})"
    crashed = [words for words, (failed, _) in scores.items() if failed >= 1.0]
    return f"- {push:g} N: {fate}" + (f"; no flight of {' or '.join(crashed)} survives" if crashed else "") + "."
