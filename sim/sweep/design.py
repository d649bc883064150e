"""One run of a sweep: everything that decides a flight, and what is measured on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ibvs_qp.pilot import PilotConfig
from sim.closed_loop import FlightOptions
from sim.faults import Fault
from sim.jobs import Job, PaintJob
from sim.scene import Scene
from sim.trace import Trace

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
