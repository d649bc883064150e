"""One run of a sweep, and a block of runs: everything that determines a flight, and the figures measured on it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from ibvs_qp.pilot import PilotConfig
from sim.faults.fault import Fault
from sim.flight.jobs import Job, PaintJob
from sim.flight.options import FlightOptions
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
