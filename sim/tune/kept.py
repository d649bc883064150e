"""Trials of an earlier search, read back from the record it left: choosing anew needs none of its flights."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import ConfigError
from sim.tune.finalists import Trials
from sim.tune.objectives import OBJECTIVES, Score
from sim.tune.search import SearchPlan, start_gains
from sim.tune.space import RANGES

#: Key of a trial's number: a killed trial leaves a gap.
NUMBER = "number"


def kept_trials(file: Path, plan: SearchPlan) -> tuple[Trials, str]:
    """Gains and score of every trial in a ``LAW_trials.json``, by number, and the command of their search.

    Args:
        file: The record of a search.
        plan: What is to be chosen for; law, seed, features and shipped gains must be those of the search.

    Returns:
        The trials, and the command.

    Raises:
        ConfigError: When the file is no such record, or of another search.
    """
    try:
        record: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        trials = {row.get(NUMBER, place): _trial(row) for place, row in enumerate(record["all_trials"])}
    except (OSError, AttributeError, KeyError, TypeError, ValueError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise ConfigError(
            f"{file} is no record of a search ({reason}); give a LAW_trials.json with --trials-of"
        ) from None
    wanted = {"law": plan.shipped.law, "seed": plan.seed, "features": plan.features}
    held = {name: record.get(name) for name in wanted}
    if held != wanted:
        other = ", ".join(f"{name} {value}" for name, value in held.items())
        raise ConfigError(f"{file} holds a search with {other}; give the same options")
    start = start_gains(plan)
    if not any(gains == start for gains, _ in trials.values()):
        raise ConfigError(
            f"{file} holds no trial of the preset to compare with; give the one it began at with --preset"
        )
    return trials, record.get("searched_by") or record.get("command", "")


def _trial(row: dict[str, float]) -> tuple[dict[str, float], Score]:
    gains = {name: float(row[name]) for name in RANGES}
    return gains, Score(tuple(float(row[each.column]) for each in OBJECTIVES), float(row["failed"]))
