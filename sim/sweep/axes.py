"""Axes of a design: a parameter and its values, listed, evenly spaced, or drawn."""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import choice, from_dict, setting, validate
from sim.sweep.design import Parameter

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
