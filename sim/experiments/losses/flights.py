"""Flights of the QP and of its opponents: the cells of nine experiments, with every opponent in each."""

from __future__ import annotations

import dataclasses

from sim.experiments.design import Choice, design
from sim.experiments.spec import Flights, experiment
from sim.sweep.design import Run

#: Experiments with a comparison of laws.
COMPARED = (
    "gust",
    "paint",
    "rivals",
    "saturation",
    "friction",
    "sloped-edge",
    "approach",
    "payload",
    "rotor-derate",
)
#: Experiments in which thrust limits act, so that the allocator matters.
LIMITED = ("gust", "rivals", "saturation", "friction", "rotor-derate")
#: Variants of the opponents by that of the QP; the analytic law clips its thrusts.
OPPONENTS = {
    "standard": ("shared-gains", "mpc"),
    "no-reach-check": ("no-reach-check-shared-gains", "no-reach-check-mpc"),
}
#: And with other allocators of the analytic law.
ALLOCATORS = {
    "standard": ("sequential", "box"),
    "no-reach-check": ("no-reach-check-sequential", "no-reach-check-box"),
}


def base_of(variant: str) -> str:
    """Variant of the QP that a variant is compared with."""
    return next((base for base in OPPONENTS if variant in (base, *OPPONENTS[base], *ALLOCATORS[base])), "")


def runs_of(names: tuple[str, ...] = COMPARED) -> list[Run]:
    """Geometric flights of experiments: every cell under the QP and every opponent, with the same seeds."""
    found = []
    for name in names:
        spec = experiment(name)
        flights = tuple(each for flown in spec.flights for each in _with_opponents(flown, name in LIMITED))
        found += design(dataclasses.replace(spec, flights=flights), Choice(features="geometric", compiled=True))
    return found


def _with_opponents(flights: Flights, limited: bool) -> list[Flights]:
    """The flights whose variants are compared, with those of the opponents; none of rendered flights."""
    if flights.rendered_only:
        return []
    variants: list[str] = []
    for base in OPPONENTS:
        if base in flights.levels.get("variant", ("standard",)):
            variants += [base, *OPPONENTS[base], *(ALLOCATORS[base] if limited else ())]
    if not variants:
        return []
    levels = {**flights.levels, "variant": tuple(variants)}
    return [dataclasses.replace(flights, levels=levels, laws=(), features="geometric", keep=False)]
