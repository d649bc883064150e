"""Rules for choosing one preset among many: nowhere clearly worse than the shipped one, and best on the mean."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ibvs_qp.config.contact_margin import least_margin
from ibvs_qp.pilot import PilotConfig
from sim.evaluate.figures import FIGURES
from sim.tune.objectives import OBJECTIVES, Score, ratios

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
