"""The experiments by name, each in a file of its own."""

from __future__ import annotations

import importlib

from sim.experiments.base import Choice, Experiment
from sim.sweep.design import Run

#: Names in the order of the report; the module of each has the same name with underscores.
NAMES = (
    "force-hold",
    "paint",
    "noise-sweep",
    "saturation",
    "sloped-edge",
    "friction",
    "gust",
    "rotor-derate",
    "approach",
    "payload",
)
ALL = "all"


def experiment(name: str) -> Experiment:
    """The experiment of a name."""
    return importlib.import_module(f"sim.experiments.{name.replace('-', '_')}").EXPERIMENT


def chosen(name: str) -> list[Experiment]:
    """One experiment, or every one for ``all``."""
    return [experiment(each) for each in (NAMES if name == ALL else (name,))]


def designs(name: str, choice: Choice) -> list[Run]:
    """Runs of one or of all experiments, in the order of the report."""
    return [run for each in chosen(name) for run in each.design(choice)]
