"""Criteria of the fault matrix, and the verdict on every row at a place: passed flights, worst figures, control."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import polars as pl

from ibvs_qp.command import SafetyState
from ibvs_qp.config.vehicle import VehicleParams
from sim.evaluate.measures import STATES
from sim.fault_matrix.design import CONTROL, SUPERVISED
from sim.faults.scenario import Expected, Scenario
from sim.sweep.parts import PARAM

#: Largest tilt [deg], and in contact: there the propellers are 0.1 m from the wall.
TILT_DEG, TILT_CONTACT_DEG = 15.0, 10.0
#: Largest true push at 1 kHz: over that of the job [-], and at all [N].
PUSH_RATIO, PUSH_N = 2.5, 12.0
#: Largest true speed [m/s].
SPEED_M_S = 1.0
#: Time from the latest begin of a retreat to the last contact [s]: the brush leaves the wall at 0.1 m/s from 3 mm.
LEAVE_S = 1.0
#: A vehicle that must retreat may advance no farther than this [m]: a stand-off, and its way until then.
ADVANCE_M = 0.2
#: Rounding of thrusts [N], and of their rate [N/s].
THRUST_ROUNDING_N, RATE_ROUNDING_N_S = 1e-6, 1e-2
#: Beginning of the reason of a flight that ended in an exception (`sim.sweep.flying`).
EXCEPTION = "error"


@dataclass(frozen=True, kw_only=True)
class Flown:
    """One flight as its row in the table holds it; a figure without data is None."""

    reason: str  # why it ended
    completed: bool  # whether the job was completed
    figures: Mapping[str, Any]
    supervised: bool = True

    def __getitem__(self, name: str) -> float:
        """A figure, NaN without data."""
        value = self.figures.get(name)
        return math.nan if value is None else float(value)


class Broken(NamedTuple):
    """A criterion that a flight breaks."""

    kind: str  # in a word
    text: str  # with the figure


def broken(
    flown: Flown, row: Scenario, expected: Expected, push_n: float, vehicle: VehicleParams
) -> tuple[Broken, ...]:
    """The criteria that a flight breaks; none for a flight that passes.

    Args:
        flown: The flight.
        row: Its row of the matrix.
        expected: Expectation at its place.
        push_n: Push of the job [N].
        vehicle: Limits of the thrusts.
    """
    if flown.reason.startswith(EXCEPTION):
        return (Broken("exception", flown.reason),)
    if flown["struck"] != 1.0:
        return (Broken("no fault", f"the fault did not occur ({flown.reason})"),)
    found = [*_thrusts(flown, vehicle)]
    if not (row.beyond and flown.supervised):  # a control flight shows the effect
        found += [*_motion(flown, row, push_n), *_outcome(flown, row, expected)]
    if flown.supervised:
        found += [*_states(flown, row, expected)]
    return tuple(found)


def _thrusts(flown: Flown, vehicle: VehicleParams) -> Iterator[Broken]:
    """Commands of every tick."""
    bad, excess, rate = (flown[name] for name in ("bad_thrusts", "box_excess_n", "rate_peak_n_s"))
    if bad > 0.0:
        yield Broken("not finite", f"{bad:.0f} ticks with thrusts that are not finite")
    if excess > THRUST_ROUNDING_N:
        yield Broken("thrust", f"thrust {excess:.2g} N outside its limits")
    if rate > vehicle.thrust_rate_n_s + RATE_ROUNDING_N_S:
        yield Broken("thrust rate", f"thrust rate {rate:.0f} N/s")


def _motion(flown: Flown, row: Scenario, push_n: float) -> Iterator[Broken]:
    """Motion of the vehicle by the truth."""
    if flown["crashed"] > 0.0:
        yield Broken("crash", flown.reason)
    if not row.rotor_lost and flown["tilt_peak_deg"] > TILT_DEG:
        yield Broken("tilt", f"tilt {flown['tilt_peak_deg']:.1f} deg")
    if not row.rotor_lost and flown["tilt_contact_deg"] > TILT_CONTACT_DEG:
        yield Broken("tilt in contact", f"tilt {flown['tilt_contact_deg']:.1f} deg in contact")
    if flown["push_peak_n"] > min(PUSH_RATIO * push_n, PUSH_N):
        yield Broken("push", f"push {flown['push_peak_n']:.1f} N")
    if flown["speed_peak_m_s"] > SPEED_M_S:
        yield Broken("speed", f"speed {flown['speed_peak_m_s']:.2f} m/s")


def _outcome(flown: Flown, row: Scenario, expected: Expected) -> Iterator[Broken]:
    """Whether the job was completed, or the wall left, as the row demands; by the truth."""
    if expected.completes and not flown.completed:
        yield Broken("not completed", f"job not completed ({flown.reason})")
    if severity(expected.reach) < severity(SafetyState.RETREAT):
        return
    if row.when_it_deviates and math.isnan(flown["deviates_s"]):
        yield Broken("not observable", "no rotor ever differed from its command")
    if flown["touching_s"] > _observable_s(flown, row) + expected.within_s + LEAVE_S:
        yield Broken("stays at the wall", f"in contact until {flown['touching_s']:.1f} s after the fault")
    if flown["advance_m"] > ADVANCE_M:
        yield Broken("advances", f"advances by {flown['advance_m']:.2f} m")


def _states(flown: Flown, row: Scenario, expected: Expected) -> Iterator[Broken]:
    """Actions of the supervisor, and whether it gave reasons."""
    if flown["state_before"] > 0.0:
        yield Broken("false alarm", f"{STATES[int(flown['state_before'])]} before the fault")
    if severity(expected.reach) > 0:
        took = flown[f"to_{expected.reach}_s"] - _observable_s(flown, row)
        if not took <= expected.within_s:
            never = math.isnan(took)
            when = "not reached" if never else f"{took:.2f} s after the fault could be observed"
            yield Broken(f"no {expected.reach}" if never else f"{expected.reach} late", f"{expected.reach} {when}")
    if flown["state"] > severity(expected.at_most):
        state = STATES[int(flown["state"])]
        yield Broken(f"{state} needless", f"{state}, no more than {expected.at_most} expected")
    if flown["unexplained"] > 0.0:
        yield Broken("no reason", "a change of state without a reason")


def _observable_s(flown: Flown, row: Scenario) -> float:
    """Time from the fault until it can be observed [s]."""
    return row.observable_s + (flown["deviates_s"] if row.when_it_deviates else 0.0)


def severity(state: str) -> int:
    """Place of a state in the order of severity."""
    return STATES.index(SafetyState(state))


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
