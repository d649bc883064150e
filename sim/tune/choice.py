"""Choosing one preset from a front: nowhere clearly worse than the shipped one, and best on the whole."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ibvs_qp.config.contact_margin import least_margin
from ibvs_qp.pilot import PilotConfig
from sim.tune.objectives import OBJECTIVES, Score

#: A preset may be this much worse than the shipped one in any objective: a tenth is about what seeds do.
ALLOWED_WORSE = 1.1
#: It may be this much worse in any objective of a single scene: fewer flights, more luck.
ALLOWED_WORSE_SCENE = 1.25
#: It keeps this much of the shipped preset's contact damping: stability is worth as much as an objective.
DAMPING_KEPT = 1.0 / ALLOWED_WORSE
#: Presets of a search that fly again, on other seeds and harder scenes, before one is chosen: the best of many trials
#: is partly luck, and what the harder scenes ask of it no trial has shown.
FINALISTS = 8


def gain_over(score: Score, shipped: Score) -> float:
    """Mean logarithm of the ratios to the shipped preset: -0.1 is 10 % less error on the (geometric) mean."""
    return sum(math.log(value / base) for value, base in zip(score.values, shipped.values, strict=True)) / len(
        OBJECTIVES
    )


def allowed(score: Score, shipped: Score, worse: float = ALLOWED_WORSE) -> bool:
    """Whether it may take the shipped preset's place.

    Args:
        score: Its own.
        shipped: The shipped preset's.
        worse: Greatest ratio of any objective.
    """
    near = all(value <= worse * base for value, base in zip(score.values, shipped.values, strict=True))
    return near and score.failed <= shipped.failed


def contact_damping(config: PilotConfig) -> float:
    """Least damping ratio of the contact over the stiffness range of the preset's brush (docs/loop_margin.md)."""
    return least_margin(config.controller, config.controller.brush).least_damping_ratio


def ranked(scores: Mapping[int, Score], shipped: Score) -> list[int]:
    """Trials that may take the shipped preset's place and better it, best first."""
    good = [number for number, each in scores.items() if allowed(each, shipped) and gain_over(each, shipped) < 0.0]
    return sorted(good, key=lambda number: (gain_over(scores[number], shipped), number))


def front(scores: Mapping[int, Score]) -> list[int]:
    """Trials that no other betters in every objective, all of whose flights completed."""
    able = {number: each.values for number, each in scores.items() if not each.failed}
    return [number for number, mine in able.items() if not any(_dominates(other, mine) for other in able.values())]


def _dominates(a: Sequence[float], b: Sequence[float]) -> bool:
    return all(x <= y for x, y in zip(a, b, strict=True)) and any(x < y for x, y in zip(a, b, strict=True))
