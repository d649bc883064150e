"""What an experiment is: a design of runs, the figures it is judged by, and how it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl
from matplotlib.figure import Figure

from ibvs_qp.pilot import PilotConfig
from sim.experiments.variants import VARIANTS
from sim.flight.closed_loop import FlightOptions, default_preset, pilot_config
from sim.flight.faults import Fault
from sim.flight.jobs import Job, PaintJob
from sim.sweep.design import FlightPlan, Measure, Parameter, Run
from sim.world.scene import Scene

LAWS = ("qp", "paper")
#: Start, approach, alignment, touch and retreat of a flight that starts near the wall [s]; sizes plan and bar only.
AROUND_S = 9.0


@dataclass(frozen=True, kw_only=True)
class Choice:
    """What the command line decides.

    Attributes:
        quick: A few cells and seeds, for minutes instead of the record.
        seed: First seed.
        features: "rendered" or "geometric".
    """

    quick: bool = False
    seed: int = 0
    features: str = "rendered"


@dataclass(frozen=True, kw_only=True)
class Column:
    """A figure shown in the table of an experiment.

    Attributes:
        metric: Column of the table of flights.
        label: In words.
        unit: Unit in which it is shown.
        scale: Factor into that unit.
        digits: Digits after the point.
        better: +1 when more is better, -1 when less is, 0 when neither.
        of_all: Whether flights that did not end as planned have it as well.
        where: Cells that it applies to, by parameter; empty is all.
    """

    metric: str
    label: str
    unit: str = ""
    scale: float = 1.0
    digits: int = 2
    better: int = -1
    of_all: bool = False
    where: Mapping[str, Parameter] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """What the QP law is held to, in the unit of the metric.

    Attributes:
        text: In words.
        metric: Column of the table.
        bound: Allowed value.
        least: Whether the bound is a lower one.
        params: Cells it holds for, by parameter; empty holds for all.
        variant: Variant it holds for.
        scale: Factor into `unit`.
        unit: Unit in which it is shown.
        failed_too: Whether flights that did not end as planned count with their figures.
        every: Whether every flight must hold it, not the median of the cell: flags, peaks, and counts of mishaps.
    """

    text: str
    metric: str
    bound: float
    least: bool = False
    params: Mapping[str, Parameter] = field(default_factory=dict)
    variant: str = "standard"
    scale: float = 1.0
    unit: str = ""
    failed_too: bool = False
    every: bool = False


@dataclass(frozen=True, kw_only=True)
class Results:
    """What the figures of an experiment are drawn from.

    Attributes:
        table: One row per flight.
        folder: Where the kept logs are.
    """

    table: pl.DataFrame
    folder: Path


#: Draws figures: file name to caption and figure; leaves out what the table has no data for.
Draw = Callable[[Results], dict[str, tuple[str, Figure]]]


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """One experiment.

    Attributes:
        name: As on the command line.
        title: One line.
        about: What is flown and measured.
        paper: What the paper, or who else is published, reports.
        design: Its runs.
        columns: Figures shown in its table.
        criteria: What the QP law is held to.
        draw: Its figures.
        params: Parameters shown in the table, with their headings.
        folded: Cells that its table folds away, as a figure shows them, by parameter.
    """

    name: str
    title: str
    about: str
    paper: str
    design: Callable[[Choice], list[Run]]
    columns: tuple[Column, ...]
    criteria: tuple[Criterion, ...]
    draw: Draw
    params: dict[str, str]
    folded: Mapping[str, Parameter] = field(default_factory=dict)


def runs(
    experiment: str,
    choice: Choice,
    *,
    scene: Scene,
    measure: Measure,
    params: Mapping[str, Parameter],
    seeds: int,
    job: Job | None = None,
    variant: str = "standard",
    laws: Sequence[str] = LAWS,
    faults: tuple[Fault, ...] = (),
    change: Callable[[PilotConfig], PilotConfig] | None = None,
    features: str | None = None,
    keep: bool = True,
) -> list[Run]:
    """Flights of one cell under every law, with the same seeds.

    Args:
        experiment: Its name.
        choice: Command line.
        scene: The truth.
        measure: What is measured.
        params: Settings of the cell.
        seeds: Number of seeds.
        job: What is done at the wall; None paints.
        variant: Key of `VARIANTS`.
        laws: Laws that fly it.
        faults: What goes wrong.
        change: Further change of the pilot, alike for both laws.
        features: Overrides those of the command line.
        keep: Whether the log of the first seed is kept.
    """
    work, flights = job or PaintJob(), []
    for law in laws:
        pilot = VARIANTS[variant].apply(default_preset(law))
        if change is not None:
            pilot = change(pilot)
        for index in range(seeds):
            options = FlightOptions(
                law=law,
                seed=choice.seed + index,
                features=features or choice.features,
                vision=VARIANTS[variant].vision,
                video=False,
            )
            config = pilot_config(scene, options, pilot)
            flights.append(
                Run(
                    experiment=experiment,
                    variant=variant,
                    params=dict(params),
                    plan=FlightPlan(scene=scene, config=config, options=options, job=work, faults=faults),
                    measure=measure,
                    keep=keep and index == 0,
                    expected_s=AROUND_S + work.expected_s(config.painting),
                )
            )
    return flights
