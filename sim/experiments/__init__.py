"""The experiments by name; each is a file in ``specs``."""

from __future__ import annotations

from sim.experiments.design import Choice, design
from sim.experiments.spec import Experiment, experiment
from sim.sweep.design import Run

#: Names in the order of the report.
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


def chosen(name: str) -> list[Experiment]:
    """One experiment, or all of them for ``all``."""
    return [experiment(each) for each in (NAMES if name == ALL else (name,))]


def designs(name: str, choice: Choice) -> list[Run]:
    """Runs of one or of all experiments, in the order of the report."""
    return [run for each in chosen(name) for run in design(each, choice)]
