"""The search: Optuna's multi-objective TPE over a journal on disk; it resumes, and several processes may share it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import joblib
import numpy as np

from ibvs_qp.config.contact_margin import require_margin
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.pilot import PilotConfig
from sim.sweep.flying import Row, fly_run
from sim.tune.flights import SEARCH_SEED, flights, scenes, seeds
from sim.tune.objectives import OBJECTIVES, Score, refused, score
from sim.tune.space import RANGES, rounded, searched_gains, with_gains

if TYPE_CHECKING:
    import optuna

#: Key under which a trial keeps its share of failed flights.
FAILED = "failed"
#: Trials before the sampler learns from them, and the greatest factor by which they change a gain: over the whole of
#: so many ranges hardly a draw would fly.
STARTUP, NEAR = 10, 1.6


@dataclasses.dataclass(frozen=True, kw_only=True)
class SearchPlan:
    """A search.

    Attributes:
        shipped: The preset it starts from; trial 0 flies its gains.
        trials: Number of finished trials at which it stops.
        seed: Of sampler and flights.
        flights: Seeds per scene and trial.
        features: "geometric" or "rendered".
        jobs: Trials side by side; one gives the same search every time, more give one that depends on their number.
        storage: Journal file, or the address of a database.
    """

    shipped: PilotConfig
    trials: int
    seed: int
    flights: int
    features: str
    jobs: int
    storage: str


def open_study(plan: SearchPlan) -> optuna.Study:
    """Open or create the study.

    Raises:
        ConfigError: When Optuna is not installed, the storage does not open, or holds another search.
    """
    try:
        import optuna
        from optuna.study import StudyDirection
    except ImportError:
        raise ConfigError("tuning needs the extra tune: pip install -c constraints.txt -e '.[tune]'") from None
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        study = optuna.create_study(
            study_name=f"{plan.shipped.law}-{plan.seed}",
            storage=_storage(plan.storage),
            directions=[StudyDirection.MINIMIZE] * len(OBJECTIVES),
            load_if_exists=True,
        )
    except Exception as error:  # files, URLs, drivers and databases each fail in their own way
        reason = str(error).split("\n")[0]
        raise ConfigError(f"cannot open {plan.storage}: {reason}; give a file or a database with --storage") from None
    identity = {"law": plan.shipped.law, "seed": plan.seed, "flights": plan.flights, "features": plan.features}
    held = {name: study.user_attrs.get(name, value) for name, value in identity.items()}
    if held != identity:
        other = ", ".join(f"{name} {value}" for name, value in held.items())
        raise ConfigError(f"{plan.storage} holds a search with {other}; give another --out, or the same options")
    for name, value in identity.items():
        study.set_user_attr(name, value)
    return study


def _storage(address: str) -> Any:
    from optuna.storages.journal import JournalFileBackend, JournalStorage

    return address if "://" in address else JournalStorage(JournalFileBackend(address))


def search(plan: SearchPlan, study: optuna.Study, told: Callable[[int], None]) -> None:
    """Fly trials until so many are finished; each batch is sampled from what was told before it.

    The sampler is seeded anew for every trial by the number of finished ones, so a search that was killed goes on as
    if it had not been.
    """
    with joblib.Parallel(n_jobs=plan.jobs) as parallel:
        while (done := len(finished(study))) < plan.trials:
            told(done)
            batch = [_ask(plan, study, done + place) for place in range(min(plan.jobs, plan.trials - done))]
            scores = evaluate([gains for _, gains in batch], plan, parallel)
            for (trial, _), each in zip(batch, scores, strict=True):
                trial.set_user_attr(FAILED, each.failed)
                trial.set_constraint(FAILED, each.failed)
                study.tell(trial, each.values)
    told(len(finished(study)))


def _ask(plan: SearchPlan, study: optuna.Study, number: int) -> tuple[optuna.Trial, dict[str, float]]:
    import optuna

    draw = int(np.random.SeedSequence([plan.seed, number]).generate_state(1)[0])
    study.sampler = optuna.samplers.TPESampler(
        seed=draw, multivariate=True, constant_liar=False, n_startup_trials=STARTUP
    )
    if number < STARTUP:
        study.enqueue_trial(_near_shipped(plan, number))
    trial = study.ask()
    return trial, {name: trial.suggest_float(name, *span, log=True) for name, span in RANGES.items()}


def start_gains(plan: SearchPlan) -> dict[str, float]:
    """Gains of trial 0: the shipped ones, within the range of the search."""
    return rounded(_near_shipped(plan, 0))


def _near_shipped(plan: SearchPlan, number: int) -> dict[str, float]:
    """The shipped gains first, then each of them times a random factor, within the range of the search."""
    factors = (
        np.random.default_rng([plan.seed, number]).uniform(-1.0, 1.0, len(RANGES)) if number else np.zeros(len(RANGES))
    )
    start = searched_gains(plan.shipped)
    return {
        name: float(np.clip(start[name] * NEAR**factor, *RANGES[name]))
        for name, factor in zip(RANGES, factors, strict=True)
    }


def evaluate(gains: Sequence[dict[str, float]], plan: SearchPlan, parallel: joblib.Parallel) -> list[Score]:
    """Fly sets of gains over all scenes; one whose contact would ring by the loop's margin is not flown."""
    scores, jobs = {}, {}
    for place, each in enumerate(gains):
        config = with_gains(plan.shipped, rounded(each))
        try:
            require_margin(config.controller, config.controller.brush)
        except ConfigError:
            scores[place] = refused()
            continue
        jobs[place] = flights(scenes(), config, "trial", seeds(SEARCH_SEED, plan.seed, plan.flights), plan.features)
    calls = [(place, run) for place, runs in jobs.items() for run in runs]
    rows: dict[int, list[Row]] = {place: [] for place in jobs}
    results: Any = parallel(joblib.delayed(fly_run)(run) for _, run in calls)
    for (place, _), row in zip(calls, results, strict=True):
        rows[place].append(row)
    return [scores[place] if place in scores else score(rows[place]) for place in range(len(gains))]


def finished(study: optuna.Study) -> dict[int, tuple[dict[str, float], Score]]:
    """Gains and score of every finished trial, by number."""
    from optuna.trial import TrialState

    return {
        trial.number: (rounded(trial.params), Score(tuple(trial.values), trial.user_attrs[FAILED]))
        for trial in study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    }
