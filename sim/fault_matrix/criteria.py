"""Criteria of a flight with a fault; pure functions of its figures (`sim.evaluate.measures`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from ibvs_qp.command import SafetyState
from ibvs_qp.config.vehicle import VehicleParams
from sim.evaluate.measures import STATES
from sim.faults.scenario import Expected, Scenario

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
