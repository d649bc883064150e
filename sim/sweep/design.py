"""One run of a sweep and a block of runs: everything that determines a flight, its figures, and the hashes of both."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import allocation
import ibvs_qp
import sim
from ibvs_qp.config.settings import to_dict
from ibvs_qp.pilot import PilotConfig
from sim.faults.fault import Fault
from sim.flight.jobs import Job, PaintJob
from sim.flight.options import FlightOptions
from sim.flight.own_class import source_of
from sim.flight.trace import Trace
from sim.world.scene import Scene

#: Value of a parameter of a cell: the types of a table's columns.
Parameter = float | int | str | bool
#: Figures of one flight by name; a figure without data is NaN.
Measure = Callable[[Trace], dict[str, float]]


@dataclass(frozen=True, kw_only=True)
class FlightPlan:
    """All inputs of a bit-identical flight."""

    scene: Scene  # the truth
    config: PilotConfig  # the complete pilot; no preset is read later
    options: FlightOptions  # law, seed, features, picture size
    job: Job = field(default_factory=PaintJob)  # task at the wall
    faults: tuple[Fault, ...] = ()  # faults and their times


@dataclass(frozen=True, kw_only=True)
class Run:
    """One flight of a design: a row of its table."""

    experiment: str  # name of its design
    variant: str  # switched part of the controller; laws compare within a variant
    params: dict[str, Parameter]  # parameters of the cell, by name with unit
    plan: FlightPlan  # the flight
    measure: Measure  # module-level function from trace to figures
    keep: bool = False  # whether the whole log is stored, for figures of single flights
    trace: bool = False  # whether the inputs of its figures are stored, to compute others later
    expected_s: float = 20.0  # expected flying time [s]; sizes the plan and the progress bar

    @property
    def law(self) -> str:
        """Control law of the flight."""
        return self.plan.options.law

    @property
    def seed(self) -> int:
        """Seed of the flight."""
        return self.plan.options.seed


@dataclass(frozen=True, kw_only=True)
class Refusal:
    """A run with single values in range that are refused together: a row with the reason and without a flight."""

    experiment: str
    variant: str
    params: dict[str, Parameter]
    law: str
    seed: int
    reason: str


@dataclass(frozen=True, kw_only=True)
class Block:
    """Runs that fly in one go and are one part on disk; small, as it is sent to other processes."""

    name: str  # hash of its runs and of the code: the same name has the same rows
    count: int  # number of runs
    expected_s: float  # expected flying time [s]; only ratios between blocks matter
    make: Callable[[], Iterable[Run | Refusal]]  # lists the runs in order, in the process of the flights


#: Folders of `sim` that only describe or draw results: a change there needs no new flight.
_AFTER_THE_FLIGHT = ("figures", "commands", "experiments", "fault_matrix", "notebook", "report", "tune")
#: Options that do not make a flight another one.
_NOT_HASHED = ("seed", "journal")
#: Suffixes of source files.
_SOURCES = (".py", ".c", ".h")
#: Hexadecimal digits of a hash: 64 bit.
_LENGTH = 16


def digest(content: Any) -> str:
    """Short hash of a JSON value."""
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:_LENGTH]


def configuration_hash(run: Run) -> str:
    """Hash of scene, configuration, options, job and faults; all seeds of a cell in one scene have the same one."""
    plan = run.plan
    options = {key: value for key, value in dataclasses.asdict(plan.options).items() if key not in _NOT_HASHED}
    return digest(
        {
            "scene": to_dict(plan.scene),
            "config": to_dict(plan.config),
            "options": options,
            "job": repr(plan.job),
            "own": own_sources((plan.options.controller, getattr(plan.job, "name", ""), *plan.options.rows)),
            "faults": [repr(fault) for fault in plan.faults],
        }
    )


def own_sources(names: Sequence[str]) -> list[str]:
    """Source code of classes of the user's, ``module:Class`` or ``file.py:Class``; empty names are left out."""
    return [source_of(name) for name in names if name]


@functools.cache
def code_hash() -> str:
    """Hash of all source code that takes part in a flight."""
    source = hashlib.sha256()
    for package in (allocation, ibvs_qp, sim):
        root = Path(next(iter(package.__path__)))
        for file in sorted(file for suffix in _SOURCES for file in root.rglob(f"*{suffix}")):
            relative = file.relative_to(root)
            if package is sim and relative.parts[0] in _AFTER_THE_FLIGHT:
                continue
            source.update(str(relative).encode() + b"\0" + file.read_bytes())
    return source.hexdigest()[:_LENGTH]


def listed_block(runs: Sequence[Run]) -> Block:
    """A block of explicitly listed runs."""
    rows = [
        (run.experiment, run.variant, run.params, configuration_hash(run), run.seed, run.measure.__qualname__, kept)
        for run in runs
        for kept in ((run.keep, run.trace),)
    ]
    return Block(
        name=digest({"rows": rows, "code": code_hash()}),
        count=len(runs),
        expected_s=sum(run.expected_s for run in runs),
        make=functools.partial(tuple, runs),
    )
