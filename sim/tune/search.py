"""The search: CMA-ES on the rule of choice, over a journal on disk, resumable, for one or several processes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import joblib
import numpy as np

from ibvs_qp.config.contact_margin import require_margin
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.motion_margin import LARGEST_SENSITIVITY, motion_sensitivity
from ibvs_qp.pilot import PilotConfig
from sim.sweep.flying import fly_run
from sim.tune.choice import STEEP, contact_damping, cost, less_damped
from sim.tune.flights import SEARCH_SEED, flights, scenes, seeds
from sim.tune.objectives import Score, refused, score
from sim.tune.space import BY_HAND, RANGES, ranges, rounded, searched_gains, with_gains

if TYPE_CHECKING:
    import optuna

#: Attributes of a trial: its objectives, and its fraction of failed flights.
VALUES, FAILED = "values", "failed"
#: First deviation of CMA-ES, of the logarithmic range of a gain [-]: a factor of 1.3 for a range of a decade. It starts
#: at the best of the first trials.
SPREAD = 0.12

#: Gains and score of trials by number.
Trials = dict[int, tuple[dict[str, float], Score]]
#: Range of every searched gain.
Spans = dict[str, tuple[float, float]]


@dataclasses.dataclass(frozen=True, kw_only=True)
class SearchPlan:
    """A search."""

    shipped: PilotConfig  # the start preset; trial 0 flies its gains
    other: PilotConfig  # the preset of the other law; trial 1 flies its gains, trial 2 those set by hand
    trials: int  # number of finished trials at the end
    seed: int  # of sampler and flights
    flights: int  # seeds per scene and trial
    features: str  # "geometric" or "rendered"
    jobs: int  # trials of a generation side by side
    storage: str  # journal file, or the address of a database


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
            study_name=f"{plan.shipped.law}-{plan.seed}",
            storage=plan.storage if "://" in plan.storage else JournalStorage(JournalFileBackend(plan.storage)),
            load_if_exists=True,
        )
    except Exception as error:  # files, URLs, drivers and databases each fail in their own way
        reason = str(error).split("\n")[0]
        raise ConfigError(f"cannot open {plan.storage}: {reason}; give a file or a database with --storage") from None
    identity = {"law": plan.shipped.law, "seed": plan.seed, "flights": plan.flights, "features": plan.features}
    stored = {name: study.user_attrs.get(name, value) for name, value in identity.items()}
    if stored != identity:
        other = ", ".join(f"{name} {value}" for name, value in stored.items())
        raise ConfigError(f"{plan.storage} has a search with {other}; give another --out, or the same options")
    for name, value in identity.items():
        study.set_user_attr(name, value)
    return study


def search(plan: SearchPlan, study: optuna.Study, progress: Callable[[int], None]) -> None:
    """Fly trials until the required number is finished, minimising `sim.tune.choice.cost`.

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
            shipped = next((each for _, each in finished(study).values()), scores[0])
            for trial, gains, each in zip(trials, batch, scores, strict=True):
                trial.set_user_attr(VALUES, each.values)
                trial.set_user_attr(FAILED, each.failed)
                ringing = less_damped(contact_damping(with_gains(plan.shipped, rounded(gains))), firm)
                study.tell(trial, cost(each, shipped) + STEEP * ringing)
    progress(len(finished(study)))


def _ask(plan: SearchPlan, study: optuna.Study, gains: dict[str, float]) -> optuna.Trial:
    """A trial of these gains."""
    study.enqueue_trial(gains)
    trial = study.ask()
    for name, span in ranges(plan.shipped).items():
        trial.suggest_float(name, *span, log=True)
    return trial


def _candidates(plan: SearchPlan, study: optuna.Study) -> list[dict[str, float]]:
    """Gains of the next trials: the rest of the starts, or of the present generation of CMA-ES.

    The optimiser runs again from its start with the costs of the finished generations. Trials that another process
    flies come last: it may have been killed.
    """
    import cmaes
    from optuna.trial import TrialState

    costs = {_key(trial.params): float(trial.values[0]) for trial in _complete(study)}
    flying = {_key(trial.params) for trial in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,))}

    def waiting(generation: list[dict[str, float]]) -> list[dict[str, float]]:
        left = [gains for gains in generation if _key(gains) not in costs]
        return sorted(left, key=lambda gains: _key(gains) in flying)

    starts = _starts(plan)
    if left := waiting(starts):
        return left
    best = min(starts, key=lambda gains: costs[_key(gains)])
    spans, bounds = ranges(plan.shipped), np.tile((0.0, 1.0), (len(RANGES), 1))
    optimizer = cmaes.CMA(mean=_to_unit(best, spans), sigma=SPREAD, bounds=bounds, seed=plan.seed)
    while True:
        draws = [optimizer.ask() for _ in range(optimizer.population_size)]
        generation = [_from_unit(draw, spans) for draw in draws]
        if left := waiting(generation):
            return left
        optimizer.tell([(draw, costs[_key(gains)]) for draw, gains in zip(draws, generation, strict=True)])


def _key(gains: dict[str, float]) -> tuple[float, ...]:
    """Gains as flown, in the order of the ranges."""
    flown = rounded(gains)
    return tuple(flown[name] for name in RANGES)


def _to_unit(gains: dict[str, float], spans: Spans) -> np.ndarray:
    """Gains as fractions of their logarithmic ranges."""
    return np.array([np.log(gains[name] / low) / np.log(high / low) for name, (low, high) in spans.items()])


def _from_unit(fractions: np.ndarray, spans: Spans) -> dict[str, float]:
    pairs = zip(spans.items(), fractions, strict=True)
    return {name: min(float(low * (high / low) ** fraction), high) for (name, (low, high)), fraction in pairs}


def _starts(plan: SearchPlan) -> list[dict[str, float]]:
    """Gains of the first trials, within the range of the search: the shipped ones, the other law's, those by hand."""
    shipped, other = searched_gains(plan.shipped), searched_gains(plan.other)
    known = [shipped, other, shipped | BY_HAND]
    return [
        {name: float(np.clip(gains[name], *span)) for name, span in ranges(plan.shipped).items()} for gains in known
    ]


def start_gains(plan: SearchPlan) -> dict[str, float]:
    """Gains of trial 0: the shipped ones, within the range of the search."""
    return rounded(_starts(plan)[0])


def evaluate(gains: Sequence[dict[str, float]], plan: SearchPlan, parallel: joblib.Parallel) -> list[Score]:
    """Fly sets of gains over all scenes; gains with an oscillating contact, or a loop close to it, are refused."""
    scores, runs = [refused()] * len(gains), {}
    for place, each in enumerate(gains):
        config = with_gains(plan.shipped, rounded(each))
        try:
            require_margin(config.controller, config.controller.brush)
        except ConfigError:
            continue
        if max(motion_sensitivity(config.controller).values()) > LARGEST_SENSITIVITY:
            continue
        on_seeds = seeds(SEARCH_SEED, plan.seed, plan.flights)
        runs[place] = flights(scenes(), config, "trial", on_seeds, plan.features)
    rows: Any = iter(parallel(joblib.delayed(fly_run)(run) for each in runs.values() for run in each))
    for place, each in runs.items():
        scores[place] = score([next(rows) for _ in each])
    return scores


def finished(study: optuna.Study) -> Trials:
    """Gains and score of every finished trial, by number."""
    return {
        trial.number: (rounded(trial.params), Score(tuple(trial.user_attrs[VALUES]), trial.user_attrs[FAILED]))
        for trial in _complete(study)
    }


def _complete(study: optuna.Study) -> list[optuna.trial.FrozenTrial]:
    from optuna.trial import TrialState

    return study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
