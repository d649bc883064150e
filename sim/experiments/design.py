"""From the data of an experiment to its runs."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import ibvs_qp
from ibvs_qp.pilot import PilotConfig
from sim.evaluate import measures
from sim.experiments import ALL, NAMES
from sim.experiments.spec import Experiment, Flights, Value, experiment
from sim.experiments.variants import VARIANTS, with_force_gain
from sim.faults.air import WindStep
from sim.faults.fault import Fault
from sim.faults.rotors import Derate, ThrustLoss
from sim.flight.jobs import OwnJob, PaintJob, PressJob
from sim.flight.options import FlightOptions, pilot_config, unsupervised
from sim.flight.own_law import check_own
from sim.flight.preflight import check_job
from sim.sweep.design import FlightPlan, Parameter, Run
from sim.sweep.setup import Setup, changed
from sim.world.board import BoardGeometry
from sim.world.random_scene import EVALUATION, random_scene
from sim.world.scene import Scene
from sim.world.worlds import DEFAULT_WORLD, in_world

#: Start, approach, alignment, touch and retreat of a flight that starts near the wall [s]; sizes plan and bar only.
AROUND_S = 9.0
#: Parameter that multiplies the force gains of the preset; no dotted path can, as presets differ.
FORCE_GAIN = "force_gain"
#: Unit vectors of wind steps: north (into the wall), east (along it), down.
DIRECTIONS = {"along the wall": (0.0, 1.0, 0.0), "off the wall": (-1.0, 0.0, 0.0)}


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Options of the command line."""

    quick: bool = False  # a few cells and seeds, for minutes instead of the record
    seed: int = 0  # first seed
    features: str = "rendered"  # "rendered" or "geometric"
    traces: bool = False  # whether the inputs of every flight's figures are kept
    compiled: bool = False  # whether the law runs as C code: the same flights, an eighth faster
    world: str = DEFAULT_WORLD  # errors of vehicle and sensors, where neither level nor experiment names a world


def chosen(name: str) -> list[Experiment]:
    """One experiment, or all of them for ``all``."""
    return [experiment(each) for each in (NAMES if name == ALL else (name,))]


def designs(name: str, choice: Choice) -> list[Run]:
    """Runs of one or of all experiments, in the order of the report."""
    return [run for each in chosen(name) for run in design(each, choice)]


def design(experiment: Experiment, choice: Choice) -> list[Run]:
    """Runs of an experiment, in the order of its file: flights, levels, laws, seeds."""
    runs = []
    for flights in (choice.quick and experiment.quick) or experiment.flights:
        if flights.rendered_only and choice.features != "rendered":
            continue
        for values in itertools.product(*flights.levels.values()):
            runs += _cell(experiment, flights, dict(zip(flights.levels, values, strict=True)), choice)
    return runs


def _cell(experiment: Experiment, flights: Flights, level: dict[str, Parameter], choice: Choice) -> Iterator[Run]:
    """Flights of one cell under every law, with the same seeds."""
    variant = str(level.get("variant", "standard"))
    for law in flights.laws or VARIANTS[variant].laws:
        options = FlightOptions(
            law=law,
            controller=VARIANTS[variant].controller,
            rows=VARIANTS[variant].rows,
            features=flights.features or choice.features,
            vision=VARIANTS[variant].vision,
            video=False,
            compiled=choice.compiled and not VARIANTS[variant].controller,
        )
        check_own(options, ibvs_qp.preset(law), OwnJob(name=flights.strategy) if flights.strategy else None)
        prepared = functools.partial(_prepared, experiment, flights, level, options, variant, choice.world)
        shared = None if flights.scene == "random" else prepared(choice.seed)
        for index in range(flights.seeds):
            setup, config = shared or prepared(choice.seed + index)
            yield Run(
                experiment=experiment.name,
                variant=variant,
                params={name: level[name] for name in experiment.params},
                plan=FlightPlan(
                    scene=setup.scene,
                    config=config,
                    options=dataclasses.replace(options, seed=choice.seed + index),
                    job=setup.job,
                    faults=_faults(flights, level),
                ),
                measure=getattr(measures, f"{flights.measure}_figures"),
                keep=flights.keep and index == 0,
                trace=choice.traces,
                expected_s=AROUND_S + setup.job.expected_s(config.painting, BoardGeometry(setup.scene).strokes),
            )


def _prepared(
    experiment: Experiment,
    flights: Flights,
    level: Mapping[str, Parameter],
    options: FlightOptions,
    variant: str,
    world: str,
    seed: int,
) -> tuple[Setup, PilotConfig]:
    """Scene, job and pilot of the flights with a seed, checked; the seed matters in random scenes only."""
    scene = _scene(flights, world_of(experiment, level, world), seed)
    setup = _setup(experiment, flights, level, options.law, variant, scene)
    config = pilot_config(setup.scene, options, setup.pilot)
    check_job(setup.scene, config, options.features, setup.job)
    return setup, config


def world_of(experiment: Experiment, level: Mapping[str, Parameter], given: str) -> str:
    """World of a cell: that of its level, of the experiment, or the one given on the command line."""
    return str(level.get("world", experiment.world or given))


def worlds_of(runs: Iterable[Run], given: str) -> dict[str, list[str]]:
    """Worlds of every experiment's runs, in their order; `given` is that of the command line."""
    found: dict[str, dict[str, None]] = {}
    for run in runs:
        found.setdefault(run.experiment, {})[world_of(experiment(run.experiment), run.params, given)] = None
    return {name: list(worlds) for name, worlds in found.items()}


def _scene(flights: Flights, world: str, seed: int) -> Scene:
    """Start values of a flight: the default scene, or the one of its seed, with the errors of a world."""
    return in_world(random_scene(seed, EVALUATION) if flights.scene == "random" else Scene(), world)


def _setup(
    experiment: Experiment, flights: Flights, level: Mapping[str, Parameter], law: str, variant: str, scene: Scene
) -> Setup:
    """Scene, pilot and job of a cell under a law, from a scene with the errors of its world."""
    values: dict[str, Value] = {**experiment.fixed, **flights.fixed}
    for name, value in level.items():
        paths = (*experiment.paths.get(name, ()), *flights.paths.get(name, ()))
        values |= dict.fromkeys(paths, value)
        values |= experiment.named.get(name, {}).get(str(value), {})
    pilot = VARIANTS[variant].apply(ibvs_qp.preset(law))
    if not flights.supervised:
        pilot = unsupervised(pilot)
    if FORCE_GAIN in level:
        pilot = with_force_gain(pilot, float(level[FORCE_GAIN]))
    job = PaintJob() if flights.measure.startswith("paint") else PressJob()
    if flights.strategy:
        job = OwnJob(name=flights.strategy)
    return changed(Setup(scene=scene, pilot=pilot, job=job), values)


def _faults(flights: Flights, level: Mapping[str, Parameter]) -> tuple[Fault, ...]:
    timing = {"after": flights.fault_after, "delay_s": flights.fault_delay_s}
    if flights.fault == "thrust loss":
        return (ThrustLoss(**timing, rotor=str(level["rotor"]), share=float(level["share"])),)
    if flights.fault == "derate":
        rotor, fraction = str(level["rotor"]), float(level["share"])
        reported = bool(level.get("reported", level.get("told", True)))  # stored tables have the older name
        return (Derate(**timing, rotor=rotor, share=fraction, reported=reported),)
    if flights.fault == "wind step":
        north, east, down = (float(level["wind"]) * entry for entry in DIRECTIONS[str(level["direction"])])
        return (WindStep(**timing, mean_m_s=(north, east, down)),)
    return ()
