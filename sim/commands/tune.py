"""``ibvs-qp tune``: search for gains, choose, and compare the choice with the shipped gains on unseen seeds."""

from __future__ import annotations

import dataclasses
import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import ibvs_qp
from sim.commands.options import (
    check_count,
    check_jobs,
    check_readable,
    check_seed,
    command_line,
    flag,
    interrupted,
    optional,
    preset_file,
)
from sim.storage.limits import LARGEST_JOURNAL

if TYPE_CHECKING:
    from rich.console import Console

    from sim.tune.search import SearchPlan, Trials

#: Most trials of a search [-]: their journal has half the size that is read, `LARGEST_JOURNAL`.
MOST_TRIALS = 100_000


@dataclasses.dataclass(frozen=True, kw_only=True)
class Tune:
    """Tune a law for push, path, place, tilt, yaw, speed, reach and thrust rate together; needs the extra tune.

    A trial flies five jobs in the datasheet world: calm, gusts, a sloping edge, and slides that stick and saturate. The
    best trials also fly four harder ones.

    Example: ibvs-qp tune --law qp --trials 200 --out runs/tune
    """

    law: Literal["qp", "paper", "mpc"] = "qp"
    """Law to tune; mpc is the predictive rival, of which the weights are searched."""
    trials: int = 200
    """Finished trials at which the search stops; trials found in --out count."""
    seed: int = 0
    """Seed of sampler and flights."""
    flights: int = 1
    """Seeds per scene in every trial."""
    unseen: int = 6
    """Seeds that compare shipped and tuned values, nine flights each; the best trials first fly half as many."""
    features: Literal["geometric", "rendered"] = "geometric"
    """Perception: a sensor model of lines, or rendered pictures (five times slower)."""
    preset: Annotated[Path | None, optional("FILE")] = None
    """Preset to start from; default: the shipped one."""
    vehicle: Annotated[Path | None, optional("FILE")] = None
    """Vehicle to tune for: TOML with [vehicle], PX4 parameters, MJCF or URDF; it replaces the preset's."""
    jobs: int = 1
    """Trials of a generation that fly side by side."""
    storage: Annotated[str | None, optional("FILE_OR_URL")] = None
    """Optuna's journal file or database: an earlier search, or one that computers share; default: in --out."""
    out: Annotated[Path | None, optional("DIR")] = None
    """Run folder; default: runs/<UTC stamp>."""
    json: Annotated[bool, flag] = False
    """Print one line of JSON on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Search, choose, compare on unseen seeds, and write."""
        from rich.console import Console

        from sim.report.rundir import RunFolder, as_json

        self._check()
        notes = Console(stderr=True, quiet=self.json)
        with RunFolder.open(self.out, resume=True) as run:
            folder, plan = run.path, self._plan(run.path)
            try:
                summary = self._search(plan, folder, words, notes)
            except KeyboardInterrupt:
                return interrupted(words, folder, f"finished trials are in {plan.storage}")
        found = "Weights" if self.law == "mpc" else "Preset"
        print(as_json(summary) if self.json else f"Report: {summary['report']}\n{found}: {summary['preset']}")
        return 0

    def _check(self) -> None:
        from sim.tune.flights import SEED_STRIDE

        check_seed(self.seed)
        for name, most in (("trials", MOST_TRIALS), ("flights", SEED_STRIDE), ("unseen", SEED_STRIDE)):
            check_count(f"--{name}", getattr(self, name), 1, most)  # more seeds would be those of the next scene
        check_jobs(self.jobs)
        preset_file(self.preset)
        preset_file(self.vehicle, "--vehicle", other_formats=True)
        if self.storage and "://" not in self.storage and os.path.lexists(self.storage):
            check_readable("--storage", Path(self.storage), LARGEST_JOURNAL)

    def _plan(self, folder: Path) -> SearchPlan:
        from ibvs_qp.pilot import PilotConfig
        from sim.tune.search import SearchPlan
        from sim.tune.space import RIVAL
        from sim.vehicles.configuration import require_vehicle, with_vehicle
        from sim.vehicles.vehicle_file import read_vehicle

        law = "qp" if self.law == RIVAL else self.law
        start = PilotConfig.from_toml(preset) if (preset := preset_file(self.preset)) else ibvs_qp.preset(law)
        if (file := preset_file(self.vehicle, "--vehicle", other_formats=True)) is not None:
            start = with_vehicle(start if preset else PilotConfig(law=law), read_vehicle(file).vehicle)
            require_vehicle(start, f"--vehicle {self.vehicle}")
        return SearchPlan(
            law=self.law,
            shipped=dataclasses.replace(start, law=law),
            other=ibvs_qp.preset("paper" if law == "qp" else "qp"),
            trials=self.trials,
            seed=self.seed,
            flights=self.flights,
            features=self.features,
            jobs=self.jobs,
            storage=self.storage or str(folder / "journal.log"),
        )

    def _search(self, plan: SearchPlan, folder: Path, words: list[str], notes: Console) -> dict[str, Any]:
        from sim.flight.working import working
        from sim.sweep.progress import sweep_progress
        from sim.tune.finalists import best_of, fly_finalists, fly_unseen
        from sim.tune.record import Outcome, write

        trials = self._trials(plan, notes)
        parts = folder / "parts"
        with sweep_progress(notes, f"{self.law}: choice") as progress:
            finalists = fly_finalists(plan, trials, -(-self.unseen // 2), parts, progress)
        table, chosen = None, best_of(finalists)
        if chosen is not None:
            with sweep_progress(notes, f"{self.law}: unseen seeds") as progress:
                table = fly_unseen(plan, trials[chosen][0], self.unseen, parts, progress)
        outcome = Outcome(
            plan=plan,
            trials=trials,
            finalists=finalists,
            table=table,
            command=command_line(words),
            again=self._again(),
        )
        with working(notes, "Drawing the report ..."):
            return write(outcome, folder)

    def _trials(self, plan: SearchPlan, notes: Console) -> Trials:
        """Trials of the search, those in its storage included."""
        from sim.sweep.progress import sweep_progress
        from sim.tune.search import finished, open_study, search

        study = open_study(plan)
        before = len(finished(study))
        with sweep_progress(notes, f"{self.law}: trials") as progress:
            search(plan, study, lambda done: progress(done, plan.trials, before))
        return finished(study)

    def _again(self) -> str:
        """The command that repeats the result on any computer."""
        default = type(self)()
        words = ["ibvs-qp", "tune", "--law", self.law, "--trials", str(self.trials)]
        for name in ("seed", "flights", "unseen", "features", "preset", "vehicle", "jobs"):
            if getattr(self, name) != getattr(default, name):
                words += [f"--{name.replace('_', '-')}", str(getattr(self, name))]
        return shlex.join(words)
