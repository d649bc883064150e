"""Results of a search: the preset, every trial, the verdict on unseen seeds, figures and a page."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from sim.evaluate.figures import FIGURES, MORE
from sim.evaluate.table import markdown
from sim.figures.style import FAINT, REFERENCE, draw_boxes, law_colour, law_name, new_figure, save, styled
from sim.report.rundir import write_json
from sim.storage.atomic import write_text
from sim.sweep.parts import PARAM, write_table
from sim.sweep.statistics import median_interval, needed, spread
from sim.tune.finalists import SHIPPED, TUNED, Finalist, best_of, shipped_score
from sim.tune.objectives import OBJECTIVES, TASK, Score, front, gain_over
from sim.tune.search import SearchPlan, Trials


def paired(table: pl.DataFrame) -> pl.DataFrame:
    """One row per scene and seed with the figures of both presets, those of the tuned one suffixed ``.tuned``."""
    first, second = (table.filter(pl.col("variant") == name) for name in (SHIPPED, TUNED))
    return first.join(second, on=[PARAM + "scene", "seed"], suffix=f".{TUNED}", maintain_order="left")


def differences(table: pl.DataFrame) -> list[dict[str, Any]]:
    """Tuned minus shipped, flight by flight, over all scenes and for each.

    Returns:
        Per scene ("all" first) and objective of its task: n, medians of both, median of the differences with its
        interval, and a verdict: "better", "worse", "same" for an interval with zero inside, "too few" flights for an
        interval, or "none" without a pair of figures.
    """
    both = paired(table)
    by_scene = both.partition_by(PARAM + "scene", maintain_order=True, as_dict=True)
    result = []
    for scene, part in {"all": both, **{str(name): rows for (name,), rows in by_scene.items()}}.items():
        for each in OBJECTIVES:
            rows = part.filter(pl.col(PARAM + TASK).is_in(each.tasks))
            if rows.is_empty():
                continue
            before, after = (_sizes(rows, name) for name in (each.name, f"{each.name}.{TUNED}"))
            change, count = median_interval(after - before), int(np.isfinite(after - before).sum())
            result.append(
                {
                    "scene": scene,
                    "objective": each.name,
                    "n": count,
                    "shipped": median_interval(before)["median"],
                    "tuned": median_interval(after)["median"],
                    "difference": change,
                    "verdict": _verdict(change, count, FIGURES[each.name].better),
                }
            )
    return result


def _sizes(rows: pl.DataFrame, name: str) -> np.ndarray:
    """Size of a figure in every row; NaN where it is missing."""
    if name not in rows.columns:
        return np.full(rows.height, math.nan)
    return np.abs(rows[name].cast(pl.Float64).fill_null(math.nan).to_numpy())


def _verdict(change: dict[str, float], count: int, better: int) -> str:
    if count < needed():
        return "too few" if count else "none"
    less, more = change["high"] < 0.0, change["low"] > 0.0
    return "better" if (more if better == MORE else less) else "worse" if less or more else "same"


def objection(table: pl.DataFrame) -> str:
    """Why the tuned preset may not be recommended after the unseen flights, or "".

    It completes less often than the shipped one, or in some scene it has no figure at all.
    """
    both = paired(table)
    before, after = (int(both[name].cast(pl.Boolean).sum() or 0) for name in ("completed", f"completed.{TUNED}"))
    if after < before:
        return f"it completes {after} of {len(both)} unseen flights, the preset of the start {before}"
    for each in differences(table):
        if math.isnan(each["tuned"]):
            return f"in the scene {each['scene']} it has no figure for {each['objective']}: no flight completes"
    return ""


#: Upper end of the axes, as a multiple of the shipped preset.
_AXES_TO = 2.0
#: Places of the objectives that are drawn: those of painting that no flight has at 0.
DRAWN = [
    place
    for place, each in enumerate(OBJECTIVES)
    if each.name in ("force_rms_n", "path_rms_m", "tilt_peak_deg", "yaw_peak_deg", "jitter_n_s")
]


def draw_front(law: str, scores: dict[int, Score], shipped: Score, chosen: int | None) -> Figure:
    """Every pair of the drawn objectives: trials, Pareto front, the shipped and the chosen preset."""
    best = front(scores)
    shown = {"trial": (FAINT, "o", 9, _points(each for each in scores.values() if not each.failed))}
    shown["on the front of all objectives"] = (law_colour(law), "o", 14, _points(scores[number] for number in best))
    shown["shipped"] = ("#222222", "x", 60, _points([shipped]))
    if chosen is not None:
        shown["chosen"] = ("#d4a017", "*", 90, _points([scores[chosen]]))
    labels, ends = [OBJECTIVES[place].label for place in DRAWN], _AXES_TO * _points([shipped])[0]
    figure, last = new_figure(7.0), len(DRAWN) - 1
    grid = figure.subplots(last, last, sharex="col", sharey="row", squeeze=False)
    for (row, column), axes in np.ndenumerate(grid):
        if column > row:
            axes.remove()
            continue
        for label, (colour, marker, size, points) in shown.items():
            axes.scatter(points[:, column], points[:, row + 1], size, colour, marker=marker, label=label)
        axes.set(xlim=(0.0, ends[column]), ylim=(0.0, ends[row + 1]))
        axes.set_xlabel(labels[column] if row == last - 1 else "")
        axes.set_ylabel(labels[row + 1] if column == 0 else "")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=4)
    figure.suptitle(f"{law_name(law)}, {len(scores)} trials", x=0.01, ha="left", fontsize=9, fontweight="bold")
    return figure


def _points(scores: Iterable[Score]) -> np.ndarray:
    """Drawn objectives of some scores in the units of their labels, (scores, objectives)."""
    scales = [OBJECTIVES[place].scale for place in DRAWN]
    return np.array([each.values for each in scores]).reshape(-1, len(OBJECTIVES))[:, DRAWN] * scales


def draw_unseen(law: str, table: pl.DataFrame) -> Figure:
    """Tuned over shipped, flight by flight; below 1 the tuned preset is better."""
    both, figure = paired(table), new_figure(2.6)
    axes = figure.subplots()
    for place, each in enumerate(OBJECTIVES[number] for number in DRAWN):
        ratios = (both[f"{each.name}.{TUNED}"].cast(float) / both[each.name].cast(float)).drop_nulls().to_numpy()
        draw_boxes(axes, [ratios[np.isfinite(ratios)]], [place], 0.5, law)
    axes.axhline(1.0, **REFERENCE)
    axes.set_xticks(range(len(DRAWN)), [OBJECTIVES[place].label.replace(", ", ",\n") for place in DRAWN])
    axes.set(ylabel="tuned over shipped", title=f"{law_name(law)}, unseen seeds")
    return figure


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """A finished search."""

    plan: SearchPlan  # the search
    trials: Trials  # gains and score by number
    finalists: dict[str, Finalist]  # finalists and the shipped preset by name
    table: pl.DataFrame | None  # flights of shipped and chosen on unseen seeds; None without a chosen trial
    command: str  # the command line
    again: str  # the command that repeats it on any computer

    @property
    def law(self) -> str:
        """Tuned law."""
        return self.plan.law

    @property
    def chosen(self) -> int | None:
        """Number of the chosen trial; None leaves the shipped preset in place."""
        return None if self.objection else best_of(self.finalists)

    @property
    def objection(self) -> str:
        """Why the best finalist is not recommended after its flights on unseen seeds, or ""."""
        return "" if self.table is None else objection(self.table)

    @property
    def scores(self) -> dict[int, Score]:
        """Scores by trial."""
        return {number: each for number, (_, each) in self.trials.items()}


def content(outcome: Outcome, folder: Path) -> dict[str, Any]:
    """The JSON, without the trials."""
    found = outcome.scores
    return {
        "schema": 1,
        "command": outcome.command,
        "law": outcome.law,
        "seed": outcome.plan.seed,
        "features": outcome.plan.features,
        "trials": len(found),
        "completed_trials": sum(not each.failed for each in found.values()),
        "front": front(found),
        "finalists": {name: _finalist(each) for name, each in outcome.finalists.items()},
        "chosen": outcome.chosen,
        "gains": None if outcome.chosen is None else outcome.trials[outcome.chosen][0],
        "objection": outcome.objection or None,
        "unseen": [] if outcome.table is None else differences(outcome.table),
        "preset": str(folder / f"{outcome.law}.toml"),
        "report": str(folder / f"report_{outcome.law}.md"),
        "run_dir": str(folder),
    }


def write(outcome: Outcome, folder: Path) -> dict[str, Any]:
    """Write all files; returns the JSON."""
    law, found, summary = outcome.law, outcome.scores, content(outcome, folder)
    gains = {} if outcome.chosen is None else outcome.trials[outcome.chosen][0]
    subject = "Weights of the predictive rival" if outcome.plan.subject.rival else "Gains"
    head = (
        f"# {subject} found by `{outcome.again}`: trial {outcome.chosen} of {len(found)}; other values are as shipped."
    )
    if outcome.chosen is None:
        head = "# As shipped: no trial of the search may replace it."
    preset = outcome.plan.subject.having(gains).to_toml()
    write_text(folder / f"{law}.toml", f"{head}\n{preset}")
    write_json(folder / f"{law}.json", {**summary, "ranges": outcome.plan.subject.spans})
    with styled():
        shipped = shipped_score(outcome.plan, outcome.trials)
        save(draw_front(law, found, shipped, outcome.chosen), folder / "figures" / f"{law}-front.png")
        if outcome.table is not None and outcome.chosen is not None:
            write_table(folder / f"{law}_unseen.parquet", outcome.table)
            save(draw_unseen(law, outcome.table), folder / "figures" / f"{law}-unseen.png")
    write_text(folder / f"report_{law}.md", "\n".join(_page(outcome, summary)) + "\n")
    return summary


def objective_columns(score: Score) -> dict[str, float]:
    """Values of a score by column."""
    return dict(zip((each.name for each in OBJECTIVES), score.values, strict=True)) | {"failed": score.failed}


def _finalist(each: Finalist) -> dict[str, Any]:
    by_scene = {name: objective_columns(score) for name, score in each.scenes.items()}
    return {**objective_columns(each.score), "damping": each.damping, "scenes": by_scene}


def _finalists(finalists: dict[str, Finalist]) -> list[str]:
    """Table of the finalists and the shipped preset."""
    if not finalists:
        return []
    objectives = [each.label for each in OBJECTIVES]
    heads = ["on the seeds of the choice", *objectives, "flights failed", "contact damping", "may replace it"]
    lines = []
    for name, each in finalists.items():
        values = (f"{one.scale * value:.3g}" for one, value in zip(OBJECTIVES, each.score.values, strict=True))
        words = "" if name == SHIPPED else "yes" if each.may_replace(finalists[SHIPPED]) else "no"
        title = name if name == SHIPPED else f"trial {name}"
        failed = f"{100.0 * each.score.failed:.0f} %"
        lines.append((title, *values, failed, f"{each.damping:.2f}", words))
    return [markdown(heads, lines)]


def _page(outcome: Outcome, summary: dict[str, Any]) -> list[str]:
    law, shipped = outcome.law, shipped_score(outcome.plan, outcome.trials)
    lines = [
        f"# Tuning of the {law_name(law)}",
        "",
        f"`{outcome.again}`: {summary['trials']} trials, of which {summary['completed_trials']} completed every flight "
        f"and {len(summary['front'])} are on the front.",
        "",
        f"![Front](figures/{law}-front.png)",
        "",
        *_finalists(outcome.finalists),
    ]
    if outcome.objection:
        return [
            *lines,
            f"The best finalist is not recommended: {outcome.objection}. The shipped preset stays.",
        ]
    if outcome.chosen is None:
        return [
            *lines,
            "No trial is better than the shipped preset on the mean without being clearly worse in an objective, a "
            "scene or in contact damping, both in the search and on the seeds of the choice: the shipped preset stays.",
        ]
    percent = 100.0 * (1.0 - math.exp(gain_over(outcome.scores[outcome.chosen], shipped)))
    lines += [
        f"Chosen: trial {outcome.chosen}; on the flights of the search its objectives are {percent:.0f} % better on "
        "the geometric mean. On unseen seeds, of neither search nor choice:",
        "",
    ]
    change = f"tuned - shipped (95 % interval; min and max of fewer than {needed()} flights)"
    heads = ("scene", "objective", "flights", "shipped", "tuned", change, "verdict")
    scale, rows = {each.name: each for each in OBJECTIVES}, []
    for each in summary["unseen"]:
        objective = scale[each["objective"]]
        a, b = (objective.scale * each[name] for name in ("shipped", "tuned"))
        median, low, high = (objective.scale * each["difference"][name] for name in ("median", "low", "high"))
        change = f"{median:+.3g} ({spread(f'{low:+.3g}', f'{high:+.3g}', each['n'])})"
        rows.append((each["scene"], objective.label, str(each["n"]), f"{a:.3g}", f"{b:.3g}", change, each["verdict"]))
    return [*lines, markdown(heads, rows), f"![Unseen seeds](figures/{law}-unseen.png)"]
