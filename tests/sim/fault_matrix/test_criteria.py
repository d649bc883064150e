"""Every criterion is broken by the flight that it is for, and by no other."""

from __future__ import annotations

import pytest
from good_flight import GOOD, VEHICLE

from sim.fault_matrix.criteria import Flown, broken
from sim.faults.scenario import Expected, Scenario

RETREAT = Expected(reach="retreat", within_s=0.3)
ROW = Scenario(name="x", observable_s=0.1)


def kinds(figures=None, *, row=ROW, expected=RETREAT, push_n=5.0, **flown):
    """Kinds of broken criteria of a good flight with changes."""
    given = Flown(**{"reason": "retreated", "completed": False, "figures": GOOD | (figures or {})} | flown)
    return [criterion.kind for criterion in broken(given, row, expected, push_n, VEHICLE)]


def test_a_good_flight_breaks_nothing():
    assert kinds() == []


@pytest.mark.parametrize(
    ("figures", "kind"),
    [
        ({"struck": 0.0}, "no fault"),
        ({"bad_thrusts": 1.0}, "not finite"),
        ({"box_excess_n": 0.01}, "thrust"),
        ({"rate_peak_n_s": 501.0}, "thrust rate"),
        ({"crashed": 1.0}, "crash"),
        ({"tilt_peak_deg": 15.1}, "tilt"),
        ({"tilt_contact_deg": 10.1}, "tilt in contact"),
        ({"push_peak_n": 12.1}, "push"),
        ({"speed_peak_m_s": 1.01}, "speed"),
        ({"touching_s": 1.5}, "stays at the wall"),
        ({"advance_m": 0.25}, "advances"),
        ({"state_before": 1.0}, "false alarm"),
        ({"to_retreat_s": 0.45}, "retreat late"),
        ({"to_retreat_s": None}, "no retreat"),
        ({"unexplained": 1.0}, "no reason"),
    ],
)
def test_each_criterion_alone(figures, kind):
    assert kinds(figures) == [kind]


def test_an_exception_is_all_that_counts():
    assert kinds({"struck": None}, reason="error: ValueError: x (pilot.py:1)") == ["exception"]


def test_the_push_is_bound_by_the_smaller_of_ratio_and_absolute_bound():
    assert kinds({"push_peak_n": 5.1}, push_n=2.0) == ["push"]
    assert kinds({"push_peak_n": 4.9}, push_n=2.0) == []
    assert kinds({"push_peak_n": 12.1}, push_n=20.0) == ["push"]


def test_a_lost_rotor_may_tilt_and_nothing_else():
    row = Scenario(name="x", observable_s=0.1, rotor_lost=True)
    assert kinds({"tilt_peak_deg": 40.0, "tilt_contact_deg": 40.0}, row=row) == []
    assert kinds({"tilt_peak_deg": 40.0, "push_peak_n": 13.0}, row=row) == ["push"]


def test_where_no_law_can_save_the_vehicle_commands_and_states_are_judged_alone():
    row = Scenario(name="x", observable_s=0.1, beyond="no hover exists")
    lost = {"crashed": 1.0, "tilt_peak_deg": 60.0, "speed_peak_m_s": 3.0, "push_peak_n": 40.0, "touching_s": 9.0}
    assert kinds(lost, row=row) == []
    assert kinds(lost | {"box_excess_n": 1.0, "to_retreat_s": None}, row=row) == ["thrust", "no retreat"]
    assert "crash" in kinds(lost, row=row, supervised=False)


def test_a_fault_to_be_survived_needs_the_completed_job_and_no_severe_state():
    survived = Expected(at_most="degraded", completes=True)
    assert kinds({"state": 1.0}, expected=survived, completed=True) == []
    assert kinds({"state": 1.0}, expected=survived) == ["not completed"]
    assert kinds({"state": 2.0}, expected=survived, completed=True) == ["retreat needless"]


def test_contact_and_advance_are_free_where_no_retreat_is_expected():
    assert kinds({"touching_s": 9.0, "advance_m": 0.5, "to_retreat_s": None}, expected=Expected()) == []


def test_without_the_supervisor_no_state_is_expected():
    figures = {"to_retreat_s": None, "state": 0.0, "unexplained": 1.0}
    assert kinds(figures, supervised=False) == []
    assert kinds(figures | {"touching_s": 9.0}, supervised=False) == ["stays at the wall"]


def test_a_stuck_rotor_can_be_found_only_once_its_command_is_another():
    row = Scenario(name="x", observable_s=0.1, rotor_lost=True, when_it_deviates=True)
    late = {"to_retreat_s": 1.3, "touching_s": 2.3}
    assert kinds(late | {"deviates_s": 1.0}, row=row) == []
    assert kinds(late | {"deviates_s": 0.5}, row=row) == ["stays at the wall", "retreat late"]
    assert "not observable" in kinds(late, row=row)
