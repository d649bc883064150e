"""The design of a spec: values of every run by its index; a run is made where and when it flies."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import to_dict
from sim.evaluate.measures import paint_figures, press_row
from sim.flight.jobs import PressJob
from sim.flight.options import pilot_config
from sim.flight.preflight import check_job
from sim.sweep.design import Block, FlightPlan, Parameter, Refusal, Run, code_hash, digest, own_sources
from sim.sweep.setup import changed
from sim.sweep.spec import SweepSpec, fractions, options_of
from sim.world.board import BoardGeometry

#: Start, approach, alignment and retreat of a flight [s]; sizes the plan only.
OVERHEAD_S = 9.0


class Place(NamedTuple):
    """Law, seed and varied values of a run."""

    law: str
    seed: int
    params: dict[str, Parameter]


@dataclass(frozen=True)
class Planned:
    """The runs of a spec: draws, then grid points, then laws, then seeds; more draws do not change the first ones."""

    spec: SweepSpec  # the spec

    def __len__(self) -> int:
        """Number of runs."""
        return self.spec.flights

    @functools.cached_property
    def base(self) -> str:
        """Hash of everything that all runs have in common."""
        spec = self.spec
        return digest(
            {
                "setups": {law: [to_dict(s.scene), to_dict(s.pilot), repr(s.job)] for law, s in spec.setups.items()},
                "options": [spec.settings.features, spec.settings.vision, spec.settings.controller, spec.settings.rows],
                "own": own_sources((spec.settings.controller, spec.settings.strategy, *spec.settings.rows)),
                "name": spec.settings.name,
                "tied": spec.tied,
                "traces": spec.settings.traces,
                "code": code_hash(),
            }
        )

    def __getstate__(self) -> dict[str, Any]:
        """The spec alone: the other process makes its own caches."""
        return {"spec": self.spec}

    def place(self, index: int) -> Place:
        """Law, seed and values of a run."""
        settings, random = self.spec.settings, self.spec.random
        index, seed = divmod(index, settings.seeds)
        index, law = divmod(index, len(settings.laws))
        values = {}
        for axis in reversed(self.spec.grid):  # the last axis changes fastest
            index, place = divmod(index, len(axis.values))
            values[axis.path] = axis.values[place]
        params, sample = {axis.path: values[axis.path] for axis in self.spec.grid}, index
        if random:
            drawn = fractions(settings.draw, settings.samples, len(random), settings.seed)[sample]
            params |= {axis.path: axis.draw(float(fraction)) for axis, fraction in zip(random, drawn, strict=True)}
        return Place(settings.laws[law], settings.seed + seed, params)

    def block(self, start: int, stop: int) -> Block:
        """Runs start, ..., stop - 1: only the spec and two numbers are sent, for any size of the block."""
        name = digest({"base": self.base, "rows": [self.place(index) for index in range(start, stop)]})
        make = functools.partial(_runs, self, start, stop)
        return Block(name=name, count=stop - start, expected_s=float(stop - start), make=make)

    def run(self, index: int) -> Run | Refusal:
        """One run; values that are refused together make a refusal."""
        law, seed, params = self.place(index)
        facts = {"experiment": self.spec.settings.name, "variant": "standard", "params": params}
        try:
            setup = changed(self.spec.setups[law], self.spec.values(params))
            options = options_of(self.spec.settings, law, seed)
            config = pilot_config(setup.scene, options, setup.pilot)
            check_job(setup.scene, config, options.features, setup.job)
        except ConfigError as error:
            return Refusal(**facts, law=law, seed=seed, reason=str(error))
        plan = FlightPlan(scene=setup.scene, config=config, options=options, job=setup.job)
        measure = press_row if isinstance(setup.job, PressJob) else paint_figures
        expected_s = OVERHEAD_S + setup.job.expected_s(config.painting, BoardGeometry(setup.scene).strokes)
        return Run(**facts, plan=plan, measure=measure, trace=self.spec.settings.traces, expected_s=expected_s)


def _runs(design: Planned, start: int, stop: int) -> Iterator[Run | Refusal]:
    return (design.run(index) for index in range(start, stop))
