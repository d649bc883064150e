"""From the rows of the matrix to its flights: each in contact and free, in every world, with and without supervisor."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterator
from dataclasses import dataclass

import ibvs_qp
from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.pilot import PilotConfig
from sim.evaluate.measures import fault_figures
from sim.experiments.scenes import short_job
from sim.faults.scenario import WATCH_S, Scenario, scenarios
from sim.flight.options import FlightOptions, pilot_config, unsupervised
from sim.flight.own_law import check_own
from sim.sweep.design import FlightPlan, Run
from sim.world.scene import Scene
from sim.world.worlds import in_world

#: Worlds of the full matrix.
WORLDS = ("ideal", "datasheet")
#: Flights of a row at a place in a world: of the record, of a quick run, and the most without the supervisor.
SEEDS, QUICK_SEEDS, CONTROL_SEEDS = 20, 1, 3
#: The job: one stroke [m], long enough for a fault in its middle.
STROKE_M = 0.5
#: Expected time of the fault from the start of the flight [s]; sizes plan and bar.
FAULT_AT_S = {"contact": 8.0, "free": 1.5}
#: Names of a flight with and without the supervisor in the column ``variant``.
SUPERVISED, CONTROL = "supervised", "control"
#: Name of the matrix in the column ``experiment``.
NAME = "faults"


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Options of the command line."""

    quick: bool = False  # one seed in one world
    seeds: int | None = None  # flights of each row at a place in a world
    pattern: str = "*"  # names of rows, with wildcards
    world: str | None = None  # name or file; None flies `WORLDS`
    seed: int = 0  # first seed
    unsupervised: bool = False  # only the flights without the supervisor
    controller: str = ""  # control law of the user's instead of the QP, as in `FlightOptions`

    def __post_init__(self) -> None:
        """Refuse a design without flights."""
        if not self.rows:
            raise out_of_range("--rows", self.pattern, "", f"no row matches; rows: {', '.join(_names())}")

    @property
    def rows(self) -> tuple[Scenario, ...]:
        """The rows that fly."""
        pattern = self.pattern.lower()
        return tuple(row for row in scenarios() if fnmatch.fnmatchcase(row.name.lower(), pattern))

    @property
    def worlds(self) -> tuple[str, ...]:
        """The worlds that are flown."""
        return (self.world,) if self.world else WORLDS[-1:] if self.quick else WORLDS

    def flights(self, variant: str) -> range:
        """Seeds of the flights of a row at a place in a world."""
        count = self.seeds or (QUICK_SEEDS if self.quick else SEEDS)
        count = min(count, CONTROL_SEEDS) if variant == CONTROL else 0 if self.unsupervised else count
        return range(self.seed, self.seed + count)


def _names() -> list[str]:
    return [row.name for row in scenarios()]


def job_scene(world: str) -> Scene:
    """The scene of every flight: one short stroke on a board that fits it, started near the wall."""
    return in_world(short_job(STROKE_M, rows=1), world)


def pilot_of(variant: str) -> PilotConfig:
    """The shipped preset of the QP law, with or without the supervisor."""
    preset = ibvs_qp.preset("qp")
    return preset if variant == SUPERVISED else unsupervised(preset)


def design(choice: Choice) -> list[Run]:
    """Every flight, in the order of the report.

    Raises:
        ConfigError: When a row cannot be flown.
    """
    check_own(FlightOptions(controller=choice.controller), pilot_of(SUPERVISED), None)
    return [run for row in choice.rows for place in row.places for run in _flights(row, place, choice)]


def _flights(row: Scenario, place: str, choice: Choice) -> Iterator[Run]:
    for world in choice.worlds:
        scene = job_scene(world)
        for variant in (SUPERVISED, CONTROL):
            for seed in choice.flights(variant):
                options = FlightOptions(seed=seed, features="geometric", video=False, controller=choice.controller)
                config = pilot_config(scene, options, pilot_of(variant))
                rotors = config.controller.vehicle.geometry.names
                faults = row.flown(place, seed, rotors)
                _check_rotors(row, faults, rotors)
                yield Run(
                    experiment=NAME,
                    variant=variant,
                    params={"row": row.name, "place": place, "world": world},
                    plan=FlightPlan(scene=scene, config=config, options=options, faults=faults),
                    measure=fault_figures,
                    expected_s=FAULT_AT_S[place] + WATCH_S,
                )


def _check_rotors(row: Scenario, faults: tuple, rotors: tuple[str, ...]) -> None:
    for fault in faults:
        if getattr(fault, "rotor", "") not in ("", *rotors):
            raise ConfigError(f"{row.name}: no rotor {fault.rotor!r}; rotors: {', '.join(rotors)}")
