"""Figures of a paint job as a flat row, without machine-dependent timings; effort of the rotors."""

from __future__ import annotations

from sim.evaluate.figures import FIGURES
from sim.evaluate.part import Part
from sim.flight.trace import Trace

#: Figures of the rotors.
_EFFORT = ("effort_n", "jitter_n_s")


def paint_figures(trace: Trace) -> dict[str, float]:
    """Every number of M, without those that depend on the computer."""
    return _numbers(trace, *(name for name, figure in FIGURES.items() if not figure.timing))


def paint_timed_figures(trace: Trace) -> dict[str, float]:
    """Figures of a paint job with a timing of the machine, the rate of perception."""
    return paint_figures(trace) | _numbers(trace, "perception_hz")


def effort_figures(trace: Trace) -> dict[str, float]:
    """Thrust effort and thrust rate over the flight after its first second."""
    return _numbers(trace, *_EFFORT)


def _numbers(trace: Trace, *names: str) -> dict[str, float]:
    """The named figures as far as they are numbers."""
    part = Part.whole(trace)
    found = {name: of(part) for name in names if (of := FIGURES[name].of) is not None}
    return {name: float(value) for name, value in found.items() if type(value) in (int, float)}
