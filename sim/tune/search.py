"""The search: CMA-ES on the rule of choice, over a journal on disk, resumable, for one or several processes."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import joblib
import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.pilot import PilotConfig
from sim.sweep.flying import fly_run
from sim.tune.flights import SEARCH_SEED, flights, seeds, training
from sim.tune.objectives import OBJECTIVES, STEEP, Score, contact_damping, cost, less_damped, refused, score
from sim.tune.space import BY_HAND, RIVAL, Spans, Subject, Values, from_unit, rounded, to_unit

if TYPE_CHECKING:
    import optuna

#: Attributes of a trial: its objectives, its fraction of failed flights, and the cost of its margins.
VALUES, FAILED, MARGINS = "values", "failed", "margins"
#: First deviation of CMA-ES, of the range of a value [-]: a factor of 1.3 for a logarithmic range of a decade. It
#: starts at the best of the first trials.
SPREAD = 0.12

#: Values and score of trials by number.
Trials = dict[int, tuple[Values, Score]]


@dataclasses.dataclass(frozen=True, kw_only=True)
class SearchPlan:
    """A search."""

    law: str  # "qp", "paper", or "mpc": the predictive rival on the preset of the QP
    shipped: PilotConfig  # the start preset; trial 0 flies its gains
    other: PilotConfig  # the preset of the other law; trial 1 has its gains, trial 2 those set by hand
    trials: int  # number of finished trials at the end
    seed: int  # of sampler and flights
    flights: int  # seeds per scene and trial
    features: str  # "geometric" or "rendered"
    jobs: int  # trials of a generation side by side
    storage: str  # journal file, or the address of a database

    @property
    def subject(self) -> Subject:
        """Flights of trial 0."""
        return Subject(self.shipped, rival=self.law == RIVAL)

    @property
    def digest(self) -> str:
        """Hash of the inputs of a trial's score: ranges, objectives, training flights and start."""
        parts = (self.subject.spans, OBJECTIVES, training(), start_gains(self))
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:12]


def open_study(plan: SearchPlan) -> optuna.Study:
    """Open or create the study.

    Raises:
        ConfigError: When Optuna is not installed, the storage does not open, or has another search.
    """
    try:
        import cmaes  # noqa: F401
        import optuna
        from optuna.storages.journal import JournalFileBackend, JournalStorage
    except ImportError:
        raise ConfigError("tuning needs the extra tune: pip install -c constraints.txt -e '.[tune]'") from None
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        study = optuna.create_study(
            study_name=f"{plan.law}-{plan.seed}",
            storage=plan.storage if "://" in plan.storage else JournalStorage(JournalFileBackend(plan.storage)),
            load_if_exists=True,
        )
    except Exception as error:  # files, URLs, drivers and databases each fail in their own way
        reason = str(error).split("\n")[0]
        raise ConfigError(f"cannot open {plan.storage}: {reason}; give a file or a database with --storage") from None
    identity = {"law": plan.law, "seed": plan.seed, "flights": plan.flights, "features": plan.features}
    identity["search"] = plan.digest
    begun = bool(study.get_trials(deepcopy=False))
    stored = {name: study.user_attrs.get(name, None if begun else value) for name, value in identity.items()}
    if stored != identity:
        other = ", ".join(f"{name} {value}" for name, value in stored.items())
        raise ConfigError(f"{plan.storage} has a search with {other}; give another --out, or the same options")
    for name, value in identity.items():
        study.set_user_attr(name, value)
    return study


def search(plan: SearchPlan, study: optuna.Study, progress: Callable[[int], None]) -> None:
    """Fly trials until the required number is finished, minimising `sim.tune.objectives.cost`.

    The candidates follow from the seed and the finished trials, so that an interrupted search continues as without the
    interruption.
    """
    firm = contact_damping(plan.shipped)
    with joblib.Parallel(n_jobs=plan.jobs) as parallel:
        while (done := len(finished(study))) < plan.trials:
            progress(done)
            batch = _candidates(plan, study)[: min(plan.jobs, plan.trials - done)]
            trials = [_ask(plan, study, gains) for gains in batch]
            scores = evaluate(batch, plan, parallel)
            for trial, gains, each in zip(trials, batch, scores, strict=True):
                subject = plan.subject.having(rounded(gains))
                margins = less_damped(contact_damping(subject.config), firm) + subject.fragility()
                trial.set_user_attr(VALUES, each.values)
                trial.set_user_attr(FAILED, each.failed)
                trial.set_user_attr(MARGINS, margins)
                study.tell(trial, cost(each, _start_score(plan, study) or each) + STEEP * margins)
    progress(len(finished(study)))


def _ask(plan: SearchPlan, study: optuna.Study, gains: dict[str, float]) -> optuna.Trial:
    """A trial of these gains."""
    study.enqueue_trial(gains)
    trial = study.ask()
    for name, (low, high) in plan.subject.spans.items():
        trial.suggest_float(name, low, high, log=low > 0.0)
    return trial


def _candidates(plan: SearchPlan, study: optuna.Study) -> list[dict[str, float]]:
    """Gains of the next trials: the rest of the starts, or of the present generation of CMA-ES.

    The optimiser runs again from its start with the costs of the finished generations. Trials that another process
    flies come last: it may have been killed.
    """
    import cmaes
    from optuna.trial import TrialState

    costs = _costs(plan, study)
    flying = {_key(trial.params) for trial in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,))}

    def waiting(generation: list[dict[str, float]]) -> list[dict[str, float]]:
        left = [gains for gains in generation if _key(gains) not in costs]
        return sorted(left, key=lambda gains: _key(gains) in flying)

    starts = _starts(plan)
    if left := waiting(starts):
        return left
    best = min(starts, key=lambda gains: costs[_key(gains)])
    spans = plan.subject.spans
    start, bounds = (
        np.array([to_unit(best[name], *span) for name, span in spans.items()]),
        np.tile((0.0, 1.0), (len(spans), 1)),
    )
    optimizer = cmaes.CMA(mean=start, sigma=SPREAD, bounds=bounds, seed=plan.seed)
    while True:
        draws = [optimizer.ask() for _ in range(optimizer.population_size)]
        generation = [_values(draw, spans) for draw in draws]
        if left := waiting(generation):
            return left
        optimizer.tell([(draw, costs[_key(gains)]) for draw, gains in zip(draws, generation, strict=True)])


def _costs(plan: SearchPlan, study: optuna.Study) -> dict[tuple[float, ...], float]:
    """Cost of every finished trial by its values: against the start, once that has flown."""
    base = _start_score(plan, study)
    return {
        _key(trial.params): (cost(_score(trial), base) if base else 0.0) + STEEP * trial.user_attrs[MARGINS]
        for trial in _complete(study)
    }


def _start_score(plan: SearchPlan, study: optuna.Study) -> Score | None:
    """Score of the start; None until it has flown."""
    start = _key(start_gains(plan))
    return next((_score(trial) for trial in _complete(study) if _key(trial.params) == start), None)


def _score(trial: optuna.trial.FrozenTrial) -> Score:
    return Score(tuple(trial.user_attrs[VALUES]), trial.user_attrs[FAILED])


def _key(values: Values) -> tuple[float, ...]:
    """Values of the flights, in alphabetical order."""
    return tuple(value for _, value in sorted(rounded(values).items()))


def _values(places: np.ndarray, spans: Spans) -> Values:
    pairs = zip(spans.items(), places, strict=True)
    return {name: from_unit(float(place), *span) for (name, span), place in pairs}


def _starts(plan: SearchPlan) -> list[Values]:
    """Values of the first trials, within the ranges: the shipped ones, the other law's gains, those by hand."""
    shipped = plan.subject.values
    known = [shipped]
    if plan.law != RIVAL:
        known += [shipped | Subject(plan.other).values, shipped | BY_HAND]
    return [{name: float(np.clip(each[name], *span)) for name, span in plan.subject.spans.items()} for each in known]


def start_gains(plan: SearchPlan) -> dict[str, float]:
    """Gains of trial 0: the shipped ones, within the range of the search."""
    return rounded(_starts(plan)[0])


def evaluate(candidates: Sequence[Values], plan: SearchPlan, parallel: joblib.Parallel) -> list[Score]:
    """Fly candidates over all jobs; one with an oscillating contact, or a loop close to it, is refused.

    The start flies in any case: the others are compared with it.
    """
    scores, runs, start = [refused()] * len(candidates), {}, start_gains(plan)
    for place, each in enumerate(candidates):
        subject = plan.subject.having(rounded(each))
        if not subject.fragility() or rounded(each) == start:
            on_seeds = seeds(SEARCH_SEED, plan.seed, plan.flights)
            runs[place] = flights(training(), subject, "trial", on_seeds, plan.features)
    rows: Any = iter(parallel(joblib.delayed(fly_run)(run) for each in runs.values() for run in each))
    for place, each in runs.items():
        scores[place] = score([next(rows) for _ in each])
    return scores


def finished(study: optuna.Study) -> Trials:
    """Gains and score of every finished trial, by number."""
    return {trial.number: (rounded(trial.params), _score(trial)) for trial in _complete(study)}


def _complete(study: optuna.Study) -> list[optuna.trial.FrozenTrial]:
    from optuna.trial import TrialState

    return study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
