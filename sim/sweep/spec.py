"""A sweep as a TOML file: flights, fixed values, varied values and their axes."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import ibvs_qp
from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.config.files import read_toml
from ibvs_qp.config.settings import choice, from_dict, setting, validate
from ibvs_qp.pilot import PilotConfig
from sim.flight.jobs import OwnJob, PaintJob, PressJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.own_law import check_own
from sim.sweep.design import Parameter
from sim.sweep.setup import Setup, changed, value_at
from sim.world.worlds import scene_in_world

#: Longest list of values [-]: each is checked under each law, at 2 ms.
MOST_VALUES = 1000


@dataclass(frozen=True, kw_only=True)
class Span:
    """A range of a parameter, as written in a spec."""

    low: float = setting(math.nan, "lower end")
    high: float = setting(math.nan, "upper end")
    steps: int = setting(0, "number of values on a grid, both ends included", low=0, high=100000)
    scale: str = choice("linear", "evenly spaced, or drawn, in the value or in its logarithm", ("linear", "log"))

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)

    def at(self, fraction: float) -> float:
        """Value at a fraction 0..1 of the way from low to high."""
        if self.scale == "log":
            return float(self.low * (self.high / self.low) ** fraction)
        return float(self.low + (self.high - self.low) * fraction)


@dataclass(frozen=True)
class Axis:
    """One varied parameter."""

    path: str  # dotted path
    values: tuple[Parameter, ...] = ()  # listed values, on a grid or to choose from; empty for a range to draw from
    span: Span | None = None  # the range of drawn or evenly spaced values
    whole: bool = False  # whether values are whole numbers

    def draw(self, fraction: float) -> Parameter:
        """The value at a uniform number 0..1."""
        if self.span is None:
            return self.values[min(int(fraction * len(self.values)), len(self.values) - 1)]
        value = self.span.at(fraction)
        return round(value) if self.whole else value

    @property
    def ends(self) -> tuple[Parameter, ...]:
        """Values to check before the sweep: all listed ones, or both ends of a range; its steps lie between them."""
        return self.values if self.span is None else (self.draw(0.0), self.draw(1.0))


def make_axis(section: str, path: str, given: Any, present: Any) -> Axis:
    """An axis of a grid or of a random design.

    Args:
        section: "grid" or "random".
        path: Dotted path.
        given: A list of values, or a table low, high, scale, and on a grid steps.
        present: The present value; an int makes whole numbers.

    Raises:
        ConfigError: When it is neither, or the range is refused.
    """
    place = f"{section}.{path}"
    if isinstance(given, list):
        return Axis(path, _listed(place, given))
    axis = Axis(path, span=_span(place, given), whole=isinstance(present, int) and not isinstance(present, bool))
    assert axis.span is not None
    steps = axis.span.steps
    if section == "random":
        if steps:
            raise ConfigError(f"{place}.steps is refused: a drawn parameter has no steps, only `samples`")
        return axis
    if steps < 1:
        raise ConfigError(f"{place}.steps = {steps} is refused: a grid needs 1, 2, 3, ... values")
    values = dict.fromkeys(axis.draw(fraction) for fraction in np.linspace(0.0, 1.0, steps))
    return dataclasses.replace(axis, values=tuple(values))


@functools.lru_cache(maxsize=4)
def fractions(kind: str, samples: int, axes: int, seed: int) -> np.ndarray:
    """Uniform numbers 0..1 of a random design, (samples, axes); more samples begin with the same numbers.

    Args:
        kind: "random", or "sobol" for points that fill the box more evenly.
        samples: Number of points.
        axes: Number of parameters.
        seed: Seed of the draw.
    """
    if kind == "sobol":
        from scipy.stats import qmc

        return qmc.Sobol(axes, rng=np.random.default_rng(seed)).random_base2((samples - 1).bit_length())[:samples]
    return np.random.default_rng(seed).random((samples, axes))


def _listed(place: str, given: list[Any]) -> tuple[Parameter, ...]:
    if not given:
        raise ConfigError(f"{place} = [] is refused: at least one value is needed")
    if len(given) > MOST_VALUES:
        more = "more are a table with low, high and steps"
        raise ConfigError(f"{place} = {len(given)} values is refused: a list has at most {MOST_VALUES}; {more}")
    for value in given:
        if not isinstance(value, (bool, int, float, str)):
            raise ConfigError(
                f"{place} = {value!r} is refused: give single values; entries of a list are {place}.0, ..."
            )
    return tuple(given)


def _span(place: str, given: Any) -> Span:
    if not isinstance(given, dict) or not {"low", "high"} <= given.keys():
        raise ConfigError(f"{place} = {given!r} is refused: give a list of values, or a table with low and high")
    span = from_dict(Span, given, place)
    if not span.low <= span.high or (span.scale == "log" and span.low <= 0.0):
        need = "low > 0 and low <= high on a logarithmic scale" if span.scale == "log" else "low <= high"
        raise ConfigError(f"{place} = [{span.low:g}, {span.high:g}] is refused: {need} is needed")
    return span


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
