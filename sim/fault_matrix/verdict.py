"""Verdict on every row of the matrix at a place: flights that passed, worst figures, and result of the control row."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from ibvs_qp.config.vehicle import VehicleParams
from sim.evaluate.measures import STATES
from sim.fault_matrix.criteria import Broken, Flown, broken
from sim.fault_matrix.design import CONTROL, SUPERVISED
from sim.faults.scenario import Expected, Scenario
from sim.sweep.parts import PARAM

#: Figures of which the table shows the worst.
WORST = ("tilt_peak_deg", "push_peak_n", "speed_peak_m_s")


@dataclass(frozen=True, kw_only=True)
class Tally:
    """Flights of one row at a place, with or without the supervisor, over all worlds."""

    n: int  # flights
    passed: int  # flights that broke no criterion
    worst: dict[str, float]  # largest value of each of `WORST`, NaN without data
    failures: tuple[tuple[str, int, tuple[Broken, ...]], ...]  # world, seed and broken criteria of the others
    retreat_s: float  # longest time from the fault to the retreat or a more severe state; NaN where none came
    states: tuple[str, ...]  # most severe states of the flights, each once, in the order of severity
    ends: tuple[str, ...]  # reasons of the ends of the flights, each once

    @property
    def how(self) -> tuple[str, ...]:
        """Kinds of broken criteria, each once, those of the most flights first."""
        kinds = Counter(criterion.kind for _, _, criteria in self.failures for criterion in criteria)
        return tuple(kind for kind, _ in kinds.most_common())


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One row of the report."""

    row: Scenario
    place: str
    flown: Tally  # with the supervisor
    control: Tally  # without

    @property
    def expected(self) -> Expected:
        """Expectation at this place."""
        return self.row.places[self.place]

    @property
    def met(self) -> bool:
        """Whether every flight with the supervisor passed."""
        return self.flown.passed == self.flown.n

    @property
    def proves_nothing(self) -> bool:
        """Whether the flights without the supervisor pass where they must fail."""
        return self.expected.control_fails and 0 < self.control.n == self.control.passed


def verdicts(rows: Sequence[Scenario], table: pl.DataFrame, push_n: float, vehicle: VehicleParams) -> list[Verdict]:
    """Verdicts on rows of the matrix, in their order; a row and place without any flight has none.

    Args:
        rows: Rows of the matrix.
        table: Flights, as `sim.sweep.run_sweep` returns them.
        push_n: Push of the job [N].
        vehicle: Limits of the thrusts.
    """
    groups: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for flight in table.iter_rows(named=True):
        groups.setdefault((flight[PARAM + "row"], flight[PARAM + "place"], flight["variant"]), []).append(flight)
    found = []
    for row in rows:
        for place, expected in row.places.items():
            of = {name: groups.get((row.name, place, name), []) for name in (SUPERVISED, CONTROL)}
            if any(of.values()):
                tally = {name: _tally(flights, row, expected, push_n, vehicle) for name, flights in of.items()}
                found.append(Verdict(row=row, place=place, flown=tally[SUPERVISED], control=tally[CONTROL]))
    return found


def _tally(
    flights: list[dict[str, Any]], row: Scenario, expected: Expected, push_n: float, vehicle: VehicleParams
) -> Tally:
    flown = [
        Flown(
            reason=flight["reason"],
            completed=flight["completed"],
            figures=flight,
            supervised=flight["variant"] == SUPERVISED,
        )
        for flight in flights
    ]
    failures = [broken(each, row, expected, push_n, vehicle) for each in flown]
    return Tally(
        n=len(flown),
        passed=sum(not criteria for criteria in failures),
        worst={name: _largest([each[name] for each in flown]) for name in WORST},
        failures=tuple(
            (flight[PARAM + "world"], flight["seed"], criteria)
            for flight, criteria in zip(flights, failures, strict=True)
            if criteria
        ),
        retreat_s=_largest([each["to_retreat_s"] for each in flown]),
        states=tuple(str(state) for place, state in enumerate(STATES) if any(each["state"] == place for each in flown)),
        ends=tuple(dict.fromkeys(each.reason for each in flown)),
    )


def _largest(values: list[float]) -> float:
    good = [value for value in values if math.isfinite(value)]
    return max(good, default=math.nan)
