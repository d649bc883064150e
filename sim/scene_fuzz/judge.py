"""Outcome of a drawn scene by the truth."""

from __future__ import annotations

import dataclasses
import traceback
from dataclasses import dataclass
from typing import Any

from ibvs_qp.config.errors import ConfigError
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.preflight import check_job
from sim.flight.trace import CRASH
from sim.scene_fuzz.draw import drawn_scene
from sim.world.worlds import in_world

#: Outcomes, the good ones first.
COMPLETE, REFUSED, FAILED, UNCLAIMED = "complete", "refused before flight", "honestly failed", "complete, not claimed"
FALSE_CLAIM, INTERNAL, CRASHED = "FALSE CLAIM", "INTERNAL ERROR", "CRASH"
OUTCOMES = (COMPLETE, REFUSED, FAILED, UNCLAIMED, FALSE_CLAIM, INTERNAL, CRASHED)
#: Outcomes that no scene may have.
BAD = (FALSE_CLAIM, INTERNAL, CRASHED)


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One draw."""

    seed: int
    moved: dict[str, Any]  # keys and their values
    outcome: str  # of `OUTCOMES`
    reason: str  # of the refusal, the pilot, the truth or the traceback

    def __str__(self) -> str:
        """One line."""
        keys = ", ".join(f"{path} = {_short(value)}" for path, value in self.moved.items())
        return f"seed {self.seed}: {self.outcome}: {keys}: {self.reason}"


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def judge(seed: int, options: FlightOptions, world: str, longest_s: float) -> Judged:
    """Draw the scene of a seed, fly it in a world, and judge the flight by the truth."""
    moved: dict[str, Any] = {}
    try:
        scene, moved = drawn_scene(seed, options.features, longest_s)
        scene, options = in_world(scene, world), dataclasses.replace(options, seed=seed)
        check_job(scene, pilot_config(scene, options), options.features)
        trace = fly(scene, options)
        figures = compute_metrics(trace)
    except ConfigError as refusal:
        return Judged(seed=seed, moved=moved, outcome=REFUSED, reason=str(refusal))
    except Exception:  # any other error is a finding
        return Judged(seed=seed, moved=moved, outcome=INTERNAL, reason=traceback.format_exc().replace("\n", " | "))
    if trace.reason.startswith(CRASH):
        return Judged(seed=seed, moved=moved, outcome=CRASHED, reason=trace.reason)
    completed, claimed = figures["completed"], figures["claimed"]
    outcome = (COMPLETE if claimed else UNCLAIMED) if completed else FALSE_CLAIM if claimed else FAILED
    return Judged(seed=seed, moved=moved, outcome=outcome, reason=f"{trace.reason}; {figures['not_completed']}")
