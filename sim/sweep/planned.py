"""The design of a spec: which run has which values; a run is made where and when it is flown."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import to_dict
from sim.evaluate.measures import paint_row, press_row
from sim.flight.jobs import PaintJob
from sim.sweep.axes import shares
from sim.sweep.design import FlightPlan, Parameter, Refusal, Run
from sim.sweep.fingerprint import code_hash, digest
from sim.sweep.setup import Setup, changed, flown_by
from sim.sweep.spec import SweepSpec, options_of

#: Start, approach, alignment and retreat of a flight [s]; sizes the plan only.
AROUND_S = 9.0


@dataclass(frozen=True)
class Place:
    """Where in the design a run is."""

    law: str
    seed: int
    params: dict[str, Parameter]


@dataclass(frozen=True)
class Planned:
    """The runs of a spec: draws, then grid points, then laws, then seeds; more draws leave the first ones as they are.

    Attributes:
        spec: The spec.
    """

    spec: SweepSpec

    def __len__(self) -> int:
        """Number of runs."""
        return math.prod(self._shape)

    @functools.cached_property
    def _shape(self) -> tuple[int, int, int, int]:
        settings = self.spec.settings
        points = math.prod(len(axis.values) for axis in self.spec.grid)
        return max(1, settings.samples), points, len(settings.laws), settings.seeds

    @functools.cached_property
    def _points(self) -> list[tuple[Parameter, ...]]:
        return list(itertools.product(*(axis.values for axis in self.spec.grid)))

    @functools.cached_property
    def base(self) -> str:
        """Hash of everything that all runs share."""
        spec = self.spec
        return digest(
            {
                "setups": {law: [to_dict(s.scene), to_dict(s.pilot), repr(s.job)] for law, s in spec.setups.items()},
                "options": [spec.settings.features, spec.settings.vision],
                "name": spec.settings.name,
                "code": code_hash(),
            }
        )

    def __getstate__(self) -> dict[str, Any]:
        """The spec alone: what is cached is made anew where it is needed."""
        return {"spec": self.spec, "base": self.base}

    def place(self, index: int) -> Place:
        """Law, seed and values of a run."""
        _, points, laws, seeds = self._shape
        index, seed = divmod(index, seeds)
        index, law = divmod(index, laws)
        sample, point = divmod(index, points)
        settings, random = self.spec.settings, self.spec.random
        params = dict(zip((axis.path for axis in self.spec.grid), self._points[point], strict=True))
        if random:
            drawn = shares(settings.draw, settings.samples, len(random), settings.seed)[sample]
            params |= {axis.path: axis.draw(float(share)) for axis, share in zip(random, drawn, strict=True)}
        return Place(law=settings.laws[law], seed=settings.seed + seed, params=params)

    def block(self, start: int, stop: int) -> PlannedBlock:
        """Runs start, ..., stop - 1."""
        return PlannedBlock(self, start, stop)

    def run(self, index: int) -> Run | Refusal:
        """One run; values that are refused together make a refusal."""
        place, settings = self.place(index), self.spec.settings
        facts = {"experiment": settings.name, "variant": "standard", "params": place.params}
        try:
            setup = changed(self.spec.setups[place.law], place.params)
        except ConfigError as error:
            return Refusal(**facts, law=place.law, seed=place.seed, reason=str(error))
        plan = self._plan(setup, place)
        seconds = AROUND_S + setup.job.expected_s(plan.config.painting)
        measure = paint_row if isinstance(setup.job, PaintJob) else press_row
        return Run(**facts, plan=plan, measure=measure, expected_s=seconds)

    def _plan(self, setup: Setup, place: Place) -> FlightPlan:
        options = options_of(self.spec.settings, place.law, place.seed)
        return FlightPlan(scene=setup.scene, config=flown_by(setup, options), options=options, job=setup.job)


@dataclass(frozen=True)
class PlannedBlock:
    """Some runs of a spec: small, whatever it holds, as only the spec and two numbers travel."""

    design: Planned
    start: int
    stop: int

    def __len__(self) -> int:
        """Number of runs."""
        return self.stop - self.start

    @property
    def name(self) -> str:
        """Hash of the shared base and of what each run has of its own."""
        places = [self.design.place(index) for index in range(self.start, self.stop)]
        return digest({"base": self.design.base, "rows": [(p.law, p.seed, p.params) for p in places]})

    def runs(self) -> Iterator[Run | Refusal]:
        """The runs."""
        return (self.design.run(index) for index in range(self.start, self.stop))
