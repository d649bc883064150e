"""``ibvs-qp explain``: tasks, limits and thrusts at one tick of a recorded flight."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import tyro

from ibvs_qp.config.errors import IbvsQpError
from sim.commands.options import flag, optional
from sim.commands.replay_bag import BAG_LOG

if TYPE_CHECKING:
    from ibvs_qp.pilot import PilotConfig
    from ibvs_qp.qp.explain import Explanation, LimitValue
    from sim.flight.trace import Trace


#: Arrays of the log that the explanation prints.
_NEEDED = (
    "phase", "outcome", "push_measured", "push_reference", "reach_margin", "contact_weight", "iterations", "thrusts",
    "unallocated",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Explain:
    """Explain one tick of a flight: target and result of every task, active limits and their cost.

    Example: ibvs-qp explain runs/2026-11-21T10-00-00 --at 12.3
    """

    run_dir: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN_OR_LOG")]
    """Run folder of a flight under the QP law, or an MCAP log of your own loop or of ``replay BAG`` (docs/logs.md)."""
    at: float
    """Time of the tick since the start [s]."""
    seed: Annotated[int | None, optional("INT")] = None
    """Must equal the run's seed, if given."""
    solver: Annotated[str | None, optional("NAME")] = None
    """Solver of the tick, a value of solver.name; default: the exact solver."""
    json: Annotated[bool, flag] = False
    """Print one JSON line on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Print the explanation."""
        from rich.console import Console

        from sim.evaluate.explanation import explain_conflict, explain_tick, flown_config, has_no_program
        from sim.evaluate.explanation_text import explanation_tables
        from sim.report.rundir import as_json

        trace = self._flight()
        tick = self._tick(trace)
        explanation, conflict, config = None, (), flown_config(trace)
        if not has_no_program(trace, tick):
            config, explanation = explain_tick(trace, tick, self.solver)
            if explanation is None:
                conflict = explain_conflict(trace, tick)
                if not conflict:
                    solver = self.solver or "the exact solver"
                    raise IbvsQpError(
                        f"{solver} finds no solution at {self.at:g} s, though no hard limits are in conflict"
                    )
        if self.json:
            print(as_json(_table(trace, tick, explanation, conflict, config)))
            return 0
        for part in explanation_tables(trace, tick, explanation, config, conflict):
            Console().print(part)
        return 0

    def _flight(self) -> Trace:
        from sim.flight.flight_log import load_run
        from sim.flight.unfinished import JOURNALS

        if self._log.is_file():
            from sim.evaluate.logged_tick import logged_tick

            return logged_tick(self._log, self.at)
        if not (self.run_dir / "log.npz").exists() and not any(self.run_dir.glob(f"{JOURNALS}*")):
            raise IbvsQpError(f"{self.run_dir} is no run folder: it has no log.npz; give the folder that paint wrote")
        trace = load_run(self.run_dir).get("qp")
        if trace is None or "program" not in trace.arrays:
            raise IbvsQpError(f"{self.run_dir} has no flight under the QP law; fly one with: ibvs-qp paint --law qp")
        if missing := [name for name in _NEEDED if name not in trace.arrays]:
            raise IbvsQpError(f"the log in {self.run_dir} lacks {', '.join(missing)}")
        if not len(trace.t):
            raise IbvsQpError(f"the flight in {self.run_dir} ended before its first tick")
        if self.seed is not None and self.seed != trace.seed:
            raise IbvsQpError(f"--seed {self.seed}: the run was flown with seed {trace.seed}")
        return trace

    @property
    def _log(self) -> Path:
        """The MCAP log, where one is given by its name or by its run folder."""
        return self.run_dir / BAG_LOG if (self.run_dir / BAG_LOG).exists() else self.run_dir

    def _tick(self, trace: Trace) -> int:
        first, last = float(trace.t[0]), float(trace.t[-1])
        if self._log.is_file():
            return 0
        if not first - 1e-6 <= self.at <= last + 1e-6:
            raise IbvsQpError(f"--at {self.at:g} s: the flight lasts from {first:g} to {last:.2f} s")
        return int(np.argmin(np.abs(trace.t - self.at)))


def _table(
    trace: Trace, tick: int, explanation: Explanation | None, conflict: tuple[LimitValue, ...], config: PilotConfig
) -> dict[str, Any]:
    """One tick as JSON: without a program no thrust limits, without a solution no tasks and no active limits."""
    from sim.evaluate.explanation import push_reduction, rejections, thrust_window

    flown = trace.thrusts[tick].tolist()
    table = {
        "schema": 1,
        "t": float(trace.t[tick]),
        "phase": trace.phases[int(trace.phase[tick])],
        "outcome": trace.outcomes[int(trace.outcome[tick])],
        "push_asked": config.painting.push_n,
        "push_reference": float(trace.push_reference[tick]),
        "push_measured": float(trace.push_measured[tick]),
        "push_reduced": push_reduction(trace, tick) or None,
        "reach_margin": float(trace.reach_margin[tick]),
        "rejected": [{"t": event.t, "text": event.text} for event in rejections(trace, tick)],
        "thrusts": flown,
        "flown_thrusts": flown,
        "thrust_lower": None,
        "thrust_upper": None,
        "tasks": [],
        "active_limits": [],
        "total_cost": None,
        "slack_cost_share": None,
        "conflict": [asdict(row) for row in conflict],
        "unallocated_wrench": trace.unallocated[tick].tolist(),
    }
    if explanation is None and not conflict:
        return table
    lower, upper = thrust_window(trace, tick, config)
    table |= {"thrust_lower": lower.tolist(), "thrust_upper": upper.tolist()}
    if explanation is None:
        return table
    every = (explanation.active_limits, explanation.limit_rows, explanation.limit_ranges, explanation.limit_cost)
    tasks = zip(explanation.tasks, explanation.cost, strict=True)
    return table | {
        "thrusts": explanation.thrusts.tolist(),
        "tasks": [asdict(task) | {"cost_share": cost} for task, cost in tasks],
        "active_limits": [
            asdict(limit) | asdict(row) | asdict(span) | {"cost_share": cost}
            for limit, row, span, cost in zip(*every, strict=True)
        ],
        "total_cost": explanation.total_cost,
        "slack_cost_share": explanation.slack_cost,
        "unallocated_wrench": explanation.unallocated_wrench.tolist(),
    }
