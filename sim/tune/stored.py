"""Trials of a search in its JSON record: written once, and read back to choose anew without its flights."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import ConfigError
from sim.storage.json_file import read_json
from sim.tune.objectives import OBJECTIVES, Score
from sim.tune.search import SearchPlan, Trials, start_gains
from sim.tune.space import Spans, Values


def objective_columns(score: Score) -> dict[str, float]:
    """Values of a score by column."""
    return dict(zip((each.name for each in OBJECTIVES), score.values, strict=True)) | {"failed": score.failed}


def trial_rows(trials: Trials) -> list[dict[str, float]]:
    """One row per trial; an interrupted trial leaves a gap in the numbers."""
    return [{"number": number, **objective_columns(score), **gains} for number, (gains, score) in trials.items()]


def stored_trials(file: Path, plan: SearchPlan) -> tuple[Trials, str]:
    """Gains and score of every trial in a ``LAW_trials.json``, by number, and the command of their search.

    Args:
        file: The record of a search.
        plan: The present search; law, seed, features and shipped gains must be those of the record.

    Raises:
        ConfigError: When the file is no such record, or of another search.
    """
    record: dict[str, Any] = read_json(file)
    if isinstance(record, dict) and "ranges" in record:
        _require_same(file, record, plan)
    try:
        trials = {
            row.get("number", place): _trial(row, plan.subject.spans) for place, row in enumerate(record["all_trials"])
        }
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise ConfigError(
            f"{file} is no record of a search ({reason}); give a LAW_trials.json with --trials-of"
        ) from None
    start = start_gains(plan)
    if not any(gains == start for gains, _ in trials.values()):
        raise ConfigError(f"{file} has no trial of the preset to compare with; give its start with --preset")
    return trials, record.get("searched_by") or record.get("command", "")


def _require_same(file: Path, record: Mapping[str, Any], plan: SearchPlan) -> None:
    """Refuse the record of another search."""
    required = {"law": plan.law, "seed": plan.seed, "features": plan.features}
    recorded = {name: record.get(name) for name in required}
    if recorded != required:
        other = ", ".join(f"{name} {value}" for name, value in recorded.items())
        raise ConfigError(f"{file} has a search with {other}; give the same options")
    if record["ranges"] != {name: list(span) for name, span in plan.subject.spans.items()}:
        raise ConfigError(f"{file} has a search over other values or ranges; it can be chosen from where it was made")


def _trial(row: Mapping[str, float], spans: Spans) -> tuple[Values, Score]:
    values = {name: float(row[name]) for name in spans}
    return values, Score(tuple(float(row[each.name]) for each in OBJECTIVES), float(row["failed"]))
