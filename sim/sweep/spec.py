"""A sweep as a TOML file: flights, fixed values, varied values."""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import ibvs_qp
from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.config.files import read_toml
from ibvs_qp.config.settings import choice, from_dict, setting, validate
from ibvs_qp.pilot import PilotConfig
from sim.flight.jobs import OwnJob, PaintJob, PressJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.own_law import check_own
from sim.sweep.axes import Axis, make_axis
from sim.sweep.setup import Setup, changed, value_at
from sim.world.worlds import scene_in_world

LAWS = ("qp", "paper")
JOBS = {"paint": PaintJob, "press": PressJob}
#: Sections of a spec with dotted paths.
SECTIONS = ("fixed", "grid", "random", "tied")
#: Most flights of a sweep [-]: a table of 43 columns then has `sim.storage.limits.MOST_CELLS`, the most that are read.
MOST_FLIGHTS = 10_000_000


@dataclass(frozen=True, kw_only=True)
class SweepSettings:
    """The keys of a spec outside its sections."""

    name: str = setting("sweep", "name of the table: letters, digits, - and _")
    about: str = setting("", "question of the sweep, in a sentence")
    job: str = choice("press", "press and slide, or paint", tuple(JOBS))
    laws: tuple[str, ...] = ("qp",)  # every point flies under each law, with the same seeds
    strategy: str = setting("", "strategy of your own instead of the job, module:Class or file.py:Class")
    controller: str = setting("", "control law of your own instead of the laws; each law's preset configures it")
    rows: tuple[str, ...] = ()  # tasks and limits of your own, module:Class or file.py:Class; they join the QP law
    features: str = choice("geometric", "sensor model of lines, or rendered pictures", ("geometric", "rendered"))
    vision: str = choice("own", "perception of rendered pictures", ("own", "paper"))
    scene: str = setting("", "scene file, in the folder of the spec; empty is the default scene")
    world: str = setting("", "ideal, datasheet, harsh, field or a file; empty: the scene file's errors, else datasheet")
    preset_qp: str = setting("", "preset of the QP law, in the folder of the spec; empty is the shipped one")
    preset_paper: str = setting("", "preset of the analytic law")
    seed: int = setting(0, "first seed", low=0, high=2**31 - 1)
    seeds: int = setting(1, "flights of every point and law: seed, seed + 1, ...", low=1, high=1_000_000)
    samples: int = setting(0, "number of draws of [random]", low=0, high=MOST_FLIGHTS)
    draw: str = choice("random", "method of the draws", ("random", "sobol"))
    traces: bool = setting(False, "keep the inputs of every flight's figures, 20 kB per second of flight")
    block_runs: int = setting(10, "runs per block: the most that an interrupt loses", low=1, high=100_000)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
        if not re.fullmatch(r"[A-Za-z0-9_-]+", self.name):
            raise out_of_range("name", self.name, "", "allowed are letters, digits, - and _")
        if not self.laws or not set(self.laws) <= set(LAWS):
            raise out_of_range("laws", list(self.laws), "", "allowed are qp and paper")


@dataclass(frozen=True, kw_only=True)
class SweepSpec:
    """A sweep, checked."""

    settings: SweepSettings  # keys outside the sections
    world: str  # name of the world, whose errors the sections may change
    setups: dict[str, Setup]  # start values of every law, [fixed] included
    grid: tuple[Axis, ...]  # axes of the grid; every combination flies
    random: tuple[Axis, ...]  # drawn axes; every draw flies at every point of the grid
    tied: dict[str, str] = field(default_factory=dict)  # further paths, and the varied one whose value each takes

    @property
    def flights(self) -> int:
        """Number of flights."""
        points, settings = math.prod(len(axis.values) for axis in self.grid), self.settings
        return max(1, settings.samples) * points * len(settings.laws) * settings.seeds

    def values(self, varied: Mapping[str, Any]) -> dict[str, Any]:
        """Values of all paths from those of the varied ones."""
        return {**varied, **{path: varied[leader] for path, leader in self.tied.items() if leader in varied}}


def load_spec(file: Path) -> SweepSpec:
    """Read a spec and check every name and every single value.

    Raises:
        ConfigError: With the file and the error in it.
    """
    table = read_toml(file)
    try:
        return parse_spec(table, file.parent)
    except ConfigError as error:
        raise ConfigError(f"{file}: {error}") from None


def parse_spec(table: dict[str, Any], folder: Path) -> SweepSpec:
    """Check the content of a spec; paths of scene and presets are relative to its folder.

    Raises:
        ConfigError: With the reason.
    """
    sections = {name: _section(table, name) for name in SECTIONS}
    settings = from_dict(SweepSettings, {key: value for key, value in table.items() if key not in SECTIONS})
    if bool(sections["random"]) != bool(settings.samples):
        raise ConfigError("samples and [random] go together: give both or neither")
    world = str(folder / settings.world) if settings.world.endswith(".toml") else settings.world or None
    scene, world = scene_in_world(folder / settings.scene if settings.scene else None, world)
    for a, b in itertools.combinations(SECTIONS, 2):
        for path in sections[a].keys() & sections[b].keys():
            raise ConfigError(f"{path} is in [{a}] and in [{b}]; leave it in one of them")
    setups = {}
    for law, file in (("qp", settings.preset_qp), ("paper", settings.preset_paper)):
        if law in settings.laws:
            pilot = PilotConfig.from_toml(folder / file) if file else ibvs_qp.preset(law)
            job = OwnJob(name=settings.strategy) if settings.strategy else JOBS[settings.job]()
            setups[law] = changed(Setup(scene=scene, pilot=pilot, job=job), sections["fixed"])
    first = setups[settings.laws[0]]
    grid, random = (
        tuple(make_axis(name, path, given, value_at(first, path)) for path, given in sections[name].items())
        for name in ("grid", "random")
    )
    spec = SweepSpec(settings=settings, world=world, setups=setups, grid=grid, random=random, tied=sections["tied"])
    for path, leader in spec.tied.items():
        if leader not in (varied := [axis.path for axis in (*grid, *random)]):
            raise out_of_range(f"[tied] {path}", leader, "", f"allowed are the varied paths {', '.join(varied)}")
    if spec.flights > MOST_FLIGHTS:
        allowed = f"at most {MOST_FLIGHTS} are flown"
        raise out_of_range("samples x grid x laws x seeds", spec.flights, "flights", allowed)
    _check_values(spec, sections["fixed"])
    return spec


def options_of(settings: SweepSettings, law: str, seed: int) -> FlightOptions:
    """Options of a flight of the spec."""
    own = {"controller": settings.controller, "rows": settings.rows}
    return FlightOptions(law=law, seed=seed, features=settings.features, vision=settings.vision, video=False, **own)


def _section(table: dict[str, Any], name: str) -> dict[str, Any]:
    given = table.get(name, {})
    if not isinstance(given, dict):
        raise ConfigError(f"{name} must be a table of dotted paths, got {given!r}")
    return flat(given, name in ("fixed", "tied"))


def flat(table: dict[str, Any], fixed: bool, prefix: str = "") -> dict[str, Any]:
    """Dotted paths of nested tables, so that a path needs no quotes; low and high make a range."""
    paths = {}
    for key, value in table.items():
        if isinstance(value, dict) and (fixed or not {"low", "high"} & value.keys()):
            paths |= flat(value, fixed, f"{prefix}{key}.")
        else:
            paths[prefix + key] = value
    return paths


def _check_values(spec: SweepSpec, fixed: dict[str, Any]) -> None:
    """Check every value alone, under every law, and that no other setting overrides it in flight."""
    varied = {path: (value,) for path, value in fixed.items()}
    varied |= {axis.path: axis.ends for axis in (*spec.grid, *spec.random)}
    for law, setup in spec.setups.items():
        options = options_of(spec.settings, law, spec.settings.seed)
        check_own(options, setup.pilot, setup.job)
        for path, values in varied.items():
            for value in values:
                values_of = spec.values({path: value})
                given = changed(setup, values_of)
                flown = dataclasses.replace(given, pilot=pilot_config(given.scene, options, given.pilot))
                pilots = (each for each in values_of if each.startswith("pilot."))
                if fixed_path := next((p for p in pilots if value_at(flown, p) != value_at(given, p)), ""):
                    raise ConfigError(
                        f"{fixed_path} cannot be set here: scene.paint, laws and vision determine it; "
                        "the pilot takes its paint job, for example, from the scene"
                    )
