"""Outcome of a scene by the truth."""

from __future__ import annotations

import dataclasses
import math
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import ConfigError
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.preflight import check_job
from sim.flight.trace import CRASH
from sim.scene_fuzz.draw import drawn_scene
from sim.world.scene import Scene, load_scene
from sim.world.worlds import in_world

#: Outcomes, the good ones first.
COMPLETE, REFUSED, FAILED, UNCLAIMED = "complete", "refused before flight", "honestly failed", "complete, not claimed"
FALSE_CLAIM, INTERNAL, CRASHED = "FALSE CLAIM", "INTERNAL ERROR", "CRASH"
OUTCOMES = (COMPLETE, REFUSED, FAILED, UNCLAIMED, FALSE_CLAIM, INTERNAL, CRASHED)
#: Outcomes that no scene may have.
BAD = (FALSE_CLAIM, INTERNAL, CRASHED)


@dataclass(frozen=True, kw_only=True)
class Checked:
    """One scene."""

    name: str  # "seed 7" of a draw, a file's name
    moved: dict[str, Any]  # keys of a draw and their values
    outcome: str  # of `OUTCOMES`
    reason: str  # of the refusal, the pilot, the truth or the traceback
    push: float = math.nan  # hardest push over that of the job; NaN without a flight

    def __str__(self) -> str:
        """One line."""
        keys = ", ".join(f"{path} = {_short(value)}" for path, value in self.moved.items())
        push = f" (push {self.push:.1f} x)" if self.push > 2.0 else ""
        return f"{self.name}: {self.outcome}: {f'{keys}: ' if keys else ''}{self.reason}{push}"


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def check_draw(seed: int, options: FlightOptions, world: str, longest_s: float) -> Checked:
    """Draw the scene of a seed, fly it in a world, and check the flight by the truth."""
    return _checked(f"seed {seed}", lambda: drawn_scene(seed, options.features, longest_s), options, world, seed)


def check_file(path: Path, options: FlightOptions, world: str, seed: int) -> Checked:
    """Fly the scene of a file in a world, and check the flight by the truth."""
    return _checked(f"{path.stem} {seed}", lambda: (load_scene(path), {}), options, world, seed)


def _checked(
    name: str,
    scene_of: Callable[[], tuple[Scene, dict[str, Any]]],
    options: FlightOptions,
    world: str,
    seed: int,
) -> Checked:
    moved: dict[str, Any] = {}
    try:
        scene, moved = scene_of()
        scene, options = in_world(scene, world), dataclasses.replace(options, seed=seed)
        check_job(scene, pilot_config(scene, options), options.features)
        trace = fly(scene, options)
        figures = compute_metrics(trace)
    except ConfigError as refusal:
        return Checked(name=name, moved=moved, outcome=REFUSED, reason=str(refusal))
    except Exception:  # any other error is a finding
        return Checked(name=name, moved=moved, outcome=INTERNAL, reason=traceback.format_exc().replace("\n", " | "))
    completed, claimed, push = figures["completed"], figures["claimed"], figures["push_peak_ratio"]
    outcome = (COMPLETE if claimed else UNCLAIMED) if completed else FALSE_CLAIM if claimed else FAILED
    if crashed := trace.reason.startswith(CRASH):
        outcome = CRASHED
    reason = trace.reason if crashed else f"{trace.reason}; {figures['not_completed']}"
    return Checked(name=name, moved=moved, outcome=outcome, reason=reason, push=push)
