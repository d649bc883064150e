"""The search: Optuna's multi-objective TPE over a journal on disk, resumable, for one or several processes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import joblib
import numpy as np

from ibvs_qp.config.contact_margin import require_margin
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.pilot import PilotConfig
from sim.sweep.flying import fly_run
from sim.tune.flights import SEARCH_SEED, flights, scenes, seeds
from sim.tune.objectives import OBJECTIVES, Score, refused, score
from sim.tune.space import RANGES, rounded, searched_gains, with_gains

if TYPE_CHECKING:
    import optuna

#: Attribute of a trial with its fraction of failed flights.
FAILED = "failed"
#: Trials before the sampler uses their results, and the greatest factor by which they change a gain: over the whole of
#: so many ranges hardly a draw would fly.
STARTUP, NEAR = 12, 1.6

#: Gains and score of trials by number.
Trials = dict[int, tuple[dict[str, float], Score]]


@dataclasses.dataclass(frozen=True, kw_only=True)
class SearchPlan:
    """A search."""

    shipped: PilotConfig  # the start preset; trial 0 flies its gains
    rival: PilotConfig  # the preset of the other law; trial 1 flies its gains
    trials: int  # number of finished trials at the end
    seed: int  # of sampler and flights
    flights: int  # seeds per scene and trial
    features: str  # "geometric" or "rendered"
    jobs: int  # trials side by side; one gives the same search every time, more give one that depends on their number
    storage: str  # journal file, or the address of a database


def open_study(plan: SearchPlan) -> optuna.Study:
    """Open or create the study.

    Raises:
        ConfigError: When Optuna is not installed, the storage does not open, or has another search.
    """
    try:
        import optuna
        from optuna.storages.journal import JournalFileBackend, JournalStorage
        from optuna.study import StudyDirection
    except ImportError:
        raise ConfigError("tuning needs the extra tune: pip install -c constraints.txt -e '.[tune]'") from None
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        study = optuna.create_study(
            study_name=f"{plan.shipped.law}-{plan.seed}",
            storage=plan.storage if "://" in plan.storage else JournalStorage(JournalFileBackend(plan.storage)),
            directions=[StudyDirection.MINIMIZE] * len(OBJECTIVES),
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
    """Fly trials until the required number is finished; the sampler uses all batches before the present one.

    The number of finished trials seeds the sampler of every trial, so that an interrupted search continues as without
    the interruption.
    """
    with joblib.Parallel(n_jobs=plan.jobs) as parallel:
        while (done := len(finished(study))) < plan.trials:
            progress(done)
            batch = [_sample(plan, study, done + place) for place in range(min(plan.jobs, plan.trials - done))]
            scores = evaluate([gains for _, gains in batch], plan, parallel)
            for (trial, _), each in zip(batch, scores, strict=True):
                trial.set_user_attr(FAILED, each.failed)
                trial.set_constraint(FAILED, each.failed)
                study.tell(trial, each.values)
    progress(len(finished(study)))


def _sample(plan: SearchPlan, study: optuna.Study, number: int) -> tuple[optuna.Trial, dict[str, float]]:
    import optuna

    draw = int(np.random.SeedSequence([plan.seed, number]).generate_state(1)[0])
    study.sampler = optuna.samplers.TPESampler(
        seed=draw, multivariate=True, constant_liar=False, n_startup_trials=STARTUP
    )
    if number < STARTUP:
        study.enqueue_trial(_start(plan, number))
    trial = study.ask()
    return trial, {name: trial.suggest_float(name, *span, log=True) for name, span in RANGES.items()}


def start_gains(plan: SearchPlan) -> dict[str, float]:
    """Gains of trial 0: the shipped ones, within the range of the search."""
    return rounded(_start(plan, 0))


def _start(plan: SearchPlan, number: int) -> dict[str, float]:
    """Gains of a trial before the sampler uses results, within the range of the search.

    Trial 0 has the shipped gains and trial 1 those of the other law; the others multiply one of the two sets by random
    factors, in turn.
    """
    count, start = len(RANGES), searched_gains(plan.rival if number % 2 else plan.shipped)
    random = np.random.default_rng([plan.seed, number])
    factors = random.uniform(-1.0, 1.0, count) if number > 1 else np.zeros(count)
    gains = zip(RANGES.items(), factors, strict=True)
    return {name: float(np.clip(start[name] * NEAR**factor, *span)) for (name, span), factor in gains}


def evaluate(gains: Sequence[dict[str, float]], plan: SearchPlan, parallel: joblib.Parallel) -> list[Score]:
    """Fly sets of gains over all scenes; gains with an oscillating contact by the loop margin are refused."""
    scores, runs = [refused()] * len(gains), {}
    for place, each in enumerate(gains):
        config = with_gains(plan.shipped, rounded(each))
        try:
            require_margin(config.controller, config.controller.brush)
        except ConfigError:
            continue
        on_seeds = seeds(SEARCH_SEED, plan.seed, plan.flights)
        runs[place] = flights(scenes(), config, "trial", on_seeds, plan.features)
    rows: Any = iter(parallel(joblib.delayed(fly_run)(run) for each in runs.values() for run in each))
    for place, each in runs.items():
        scores[place] = score([next(rows) for _ in each])
    return scores


def finished(study: optuna.Study) -> Trials:
    """Gains and score of every finished trial, by number."""
    from optuna.trial import TrialState

    return {
        trial.number: (rounded(trial.params), Score(tuple(trial.values), trial.user_attrs[FAILED]))
        for trial in study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    }
