"""Results of a search: the preset, every trial, the verdict on unseen seeds, figures and a page."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from sim.evaluate.table import markdown
from sim.figures.style import save, styled
from sim.flight.trace import law_name
from sim.report.rundir import write_json
from sim.storage.atomic import write_text
from sim.sweep.parts import write_table
from sim.sweep.statistics import needed, spread
from sim.tune.choice import front, gain_over
from sim.tune.figures import draw_front, draw_unseen
from sim.tune.finalists import SHIPPED, Finalist, best_of, shipped_score
from sim.tune.objectives import OBJECTIVES, Score
from sim.tune.search import SearchPlan, Trials
from sim.tune.verdict import differences, objection


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
