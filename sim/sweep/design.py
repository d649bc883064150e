"""One run of a sweep, and a design of many: everything that decides a flight, and what is measured on it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from ibvs_qp.pilot import PilotConfig
from sim.flight.closed_loop import FlightOptions
from sim.flight.faults import Fault
from sim.flight.jobs import Job, PaintJob
from sim.flight.trace import Trace
from sim.world.scene import Scene

#: Value of a parameter of a cell: what a table can hold.
Parameter = float | int | str | bool
#: Figures of one flight by name; what has no data is NaN.
Measure = Callable[[Trace], dict[str, float]]


@dataclass(frozen=True, kw_only=True)
class FlightPlan:
    """Everything that decides a flight to the bit.

    Attributes:
        scene: The truth.
        config: The pilot, complete: no preset is looked up any more.
        options: Law, seed, features, picture size.
        job: What is done at the wall.
        faults: What goes wrong, and when.
    """

    scene: Scene
    config: PilotConfig
    options: FlightOptions
    job: Job = field(default_factory=PaintJob)
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Run:
    """One flight of a design: a row of its table.

    Attributes:
        experiment: Name of the design it belongs to.
        variant: What of the controller is switched differently; laws compare within a variant.
        params: Settings of the cell, by name with unit.
        plan: The flight.
        measure: Module-level function that turns its trace into figures.
        keep: Whether the whole log is kept, for figures of single flights.
        expected_s: Flying time to expect [s]; sizes the plan and the bar.
    """

    experiment: str
    variant: str
    params: dict[str, Parameter]
    plan: FlightPlan
    measure: Measure
    keep: bool = False
    expected_s: float = 20.0

    @property
    def law(self) -> str:
        """Law flown."""
        return self.plan.options.law

    @property
    def seed(self) -> int:
        """Seed flown."""
        return self.plan.options.seed


@dataclass(frozen=True, kw_only=True)
class Refusal:
    """A run whose values are refused together, though each alone is allowed: a row with the reason, never flown."""

    experiment: str
    variant: str
    params: dict[str, Parameter]
    law: str
    seed: int
    reason: str


class Block(Protocol):
    """Runs that are flown in one go and share a part on disk; sent to other processes, so it must be small."""

    def __len__(self) -> int:
        """Number of runs."""
        ...

    @property
    def name(self) -> str:
        """Identity: the same name has the same rows."""
        ...

    def runs(self) -> Iterable[Run | Refusal]:
        """The runs, in order; made where they are flown."""
        ...


class Design(Protocol):
    """A sequence of runs that are made when they are needed, so that a million of them fit into memory."""

    def __len__(self) -> int:
        """Number of runs."""
        ...

    def block(self, start: int, stop: int) -> Block:
        """Runs start, ..., stop - 1."""
        ...


@dataclass(frozen=True)
class ListedBlock:
    """A block of runs that were listed one by one."""

    listed: tuple[Run, ...]

    def __len__(self) -> int:
        """Number of runs."""
        return len(self.listed)

    @property
    def name(self) -> str:
        """Hash of the runs and of the code that flies them."""
        from sim.sweep.fingerprint import block_hash

        return block_hash(self.listed)

    @property
    def expected_s(self) -> float:
        """Flying time to expect [s]."""
        return sum(run.expected_s for run in self.listed)

    def runs(self) -> Sequence[Run]:
        """The runs."""
        return self.listed


@dataclass(frozen=True)
class Listed:
    """A design whose runs were listed one by one."""

    listed: Sequence[Run]

    def __len__(self) -> int:
        """Number of runs."""
        return len(self.listed)

    def block(self, start: int, stop: int) -> ListedBlock:
        """Runs start, ..., stop - 1."""
        return ListedBlock(tuple(self.listed[start:stop]))
