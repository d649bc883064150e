"""Objectives of the search, and the choice of one preset: nowhere clearly worse than the shipped one, best overall."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ibvs_qp.config.contact_margin import least_margin
from ibvs_qp.pilot import PilotConfig
from sim.evaluate.figures import FIGURES, MORE
from sim.sweep.parts import PARAM

#: Tasks of the flights, as parameter `TASK` of their rows.
PAINT, SLIDE, SATURATED = "paint", "slide", "saturated slide"
TASK = "task"


@dataclass(frozen=True)
class Objective:
    """A figure to improve."""

    name: str
    failed: float  # value of a flight that does not complete, in SI: far worse than that of any completed one
    worse: float = 1.1  # greatest ratio to the shipped preset that may replace it; seeds alone change it by a tenth
    tasks: tuple[str, ...] = (PAINT, SLIDE, SATURATED)  # tasks whose flights have it

    @property
    def label(self) -> str:
        """Words with unit."""
        return FIGURES[self.name].label

    @property
    def scale(self) -> float:
        """Factor from SI to the unit of the label."""
        return FIGURES[self.name].scale

    def ratio(self, value: float, base: float) -> float:
        """Ratio of a value to that of the shipped preset, above 1 for a worse one.

        The least difference that matters is added to both, so that the ratio stays finite where a figure is 0. The sign
        of a figure does not count.
        """
        value, base = abs(value), abs(base)
        least = FIGURES[self.name].least[0] / self.scale
        ratio = (value + least) / (base + least)
        return 1.0 / ratio if FIGURES[self.name].better == MORE else ratio


OBJECTIVES = (
    Objective("force_rms_n", 3.0, tasks=(PAINT, SLIDE)),  # a saturated slide has delivered_share
    Objective("path_rms_m", 0.05),
    Objective("place_error_m", 0.05, worse=1.25, tasks=(PAINT,)),  # two strokes a flight: it changes more by luck
    Objective("tilt_peak_deg", 20.0),
    Objective("yaw_peak_deg", 20.0),
    Objective("speed_error_share", 1.0, worse=1.25, tasks=(SLIDE, SATURATED)),
    Objective("stuck_share", 1.0, worse=1.25, tasks=(SLIDE, SATURATED)),
    Objective("delivered_share", 0.1, worse=1.02, tasks=(SLIDE, SATURATED)),
    # It wears motors and costs no accuracy; a quarter more is an eighth of the limit of 500 N/s.
    Objective("jitter_n_s", 1000.0, worse=1.25, tasks=(PAINT,)),
)


@dataclass(frozen=True)
class Score:
    """Quality of a preset."""

    values: tuple[float, ...]  # mean of every objective; NaN for one that no flight has
    failed: float  # fraction of flights that did not complete; 1 for a preset with an oscillating contact


def score(rows: Iterable[Mapping[str, Any]]) -> Score:
    """Means over flights; a failed flight, or one without the figure, counts with the objective's `failed`."""
    rows = list(rows)
    return Score(tuple(_mean(rows, each) for each in OBJECTIVES), sum(not row["completed"] for row in rows) / len(rows))


def refused() -> Score:
    """Score of a refused preset."""
    return Score(tuple(each.failed for each in OBJECTIVES), 1.0)


def ratios(score: Score, shipped: Score) -> list[tuple[Objective, float]]:
    """Ratios of the objectives that both have, above 1 for worse."""
    pairs = zip(OBJECTIVES, score.values, shipped.values, strict=True)
    return [(each, each.ratio(value, base)) for each, value, base in pairs if math.isfinite(value + base)]


def _mean(rows: list[Mapping[str, Any]], objective: Objective) -> float:
    values = [_value(row, objective) for row in rows if row[PARAM + TASK] in objective.tasks]
    return sum(values) / len(values) if values else math.nan


def _value(row: Mapping[str, Any], objective: Objective) -> float:
    value = row.get(objective.name)
    if not row["completed"] or value is None or not math.isfinite(value):
        return objective.failed
    worst = max if FIGURES[objective.name].better == MORE else min
    return worst(abs(float(value)), objective.failed)


#: The bounds of the objectives are this much wider in a single scene [-]: fewer flights, more luck.
SCENE_ROOM = 1.15
#: Least ratio to the shipped preset's contact damping [-]: stability is worth as much as an objective.
LEAST_DAMPING = 0.9
#: Damping ratio as which an undamped contact counts [-]; it keeps the cost finite.
LEAST_COUNTED_DAMPING = 1e-3
#: Slope of the cost beyond the bound of an objective: one of nine objectives must not buy room for the others [-].
STEEP = 2.0
#: Presets of a search that fly again, on other seeds and harder scenes, before the choice: the best of many trials is
#: partly luck, and no trial flew the harder scenes.
FINALISTS = 8


def gain_over(score: Score, shipped: Score) -> float:
    """Mean logarithm of the ratios to the shipped preset: -0.1 is 10 % less error on the (geometric) mean."""
    found = ratios(score, shipped)
    return sum(math.log(ratio) for _, ratio in found) / len(found)


def cost(score: Score, shipped: Score) -> float:
    """Cost of the search: `gain_over`, and steeply more beyond the bound of an objective."""
    beyond = sum(max(0.0, each) for each in _beyond(score, shipped))
    return gain_over(score, shipped) + STEEP * beyond


def allowed(score: Score, shipped: Score, room: float = 1.0) -> bool:
    """Whether a preset is good enough to replace the shipped one.

    Args:
        score: Its own.
        shipped: The shipped preset's.
        room: Factor on the bound of every objective.
    """
    return max(_beyond(score, shipped)) <= math.log(room) and score.failed <= shipped.failed


def _beyond(score: Score, shipped: Score) -> list[float]:
    """Logarithm of each objective over its bound."""
    return [math.log(ratio / objective.worse) for objective, ratio in ratios(score, shipped)]


def contact_damping(config: PilotConfig) -> float:
    """Least damping ratio of the contact over the stiffness range of the brush (docs/how_it_works/contact.md)."""
    return least_margin(config.controller, config.controller.brush).least_damping_ratio


def less_damped(damping: float, shipped: float) -> float:
    """Logarithm by which a contact's damping ratio is below its bound; 0 above it.

    Args:
        damping: Least damping ratio of the contact; an undamped one counts as `LEAST_COUNTED_DAMPING`.
        shipped: That of the shipped preset.
    """
    return max(0.0, math.log(LEAST_DAMPING * shipped / max(damping, LEAST_COUNTED_DAMPING)))


def ranked(scores: Mapping[int, Score], shipped: Score) -> list[int]:
    """Trials that may replace the shipped preset and are better on the mean, best first."""
    good = [number for number, each in scores.items() if allowed(each, shipped) and gain_over(each, shipped) < 0.0]
    return sorted(good, key=lambda number: (gain_over(scores[number], shipped), number))


def front(scores: Mapping[int, Score]) -> list[int]:
    """Pareto front: trials with all flights completed and no other trial better or equal in every objective."""
    able = [number for number, each in scores.items() if not each.failed]
    sign = [-FIGURES[each.name].better for each in OBJECTIVES]  # less is better in every column
    values = np.nan_to_num([scores[number].values for number in able]).reshape(-1, len(sign)) * sign
    return [
        number
        for number, mine in zip(able, values, strict=True)
        if not ((values <= mine).all(axis=1) & (values < mine).any(axis=1)).any()
    ]
