"""Criteria, design, verdicts and page of the fault matrix, from made-up flights and tables."""

from __future__ import annotations

import math
from pathlib import Path

import polars as pl
import pytest
from good_flight import GOOD, VEHICLE

from ibvs_qp.config.errors import ConfigError
from sim.fault_matrix.design import CONTROL, SUPERVISED, Choice, design, job_scene
from sim.fault_matrix.page import hovers, limits_after, page
from sim.fault_matrix.verdict import Flown, broken, verdicts
from sim.faults.rotors import RotorStuck, ThrustLoss
from sim.faults.scenario import PLACES, Expected, Scenario, scenario, scenarios
from sim.world.true_vehicle import true_vehicle

ROOT = Path(__file__).parents[3]
ROWS = (
    Scenario(name="a", observable_s=0.1, contact=Expected(reach="retreat"), free=Expected(control_fails=False)),
    Scenario(name="b", contact=Expected(reach="retreat")),
)


def table(*flights):
    """A table of flights: row, place, variant, seed and changed figures of each."""
    rows = [
        {
            "variant": variant,
            "seed": seed,
            "reason": "retreated",
            "completed": False,
            "param.row": row,
            "param.place": place,
            "param.world": "ideal",
            **GOOD,
            **figures,
        }
        for row, place, variant, seed, figures in flights
    ]
    return pl.DataFrame(rows)


FLIGHTS = table(
    ("a", "contact", SUPERVISED, 0, {"push_peak_n": 7.0}),
    ("a", "contact", SUPERVISED, 1, {"push_peak_n": 13.0, "to_retreat_s": 0.39}),
    ("a", "contact", CONTROL, 0, {"crashed": 1.0, "reason": "crash: hit the ground"}),
    ("a", "free", SUPERVISED, 0, {}),
    ("a", "free", CONTROL, 0, {}),
    ("b", "contact", SUPERVISED, 0, {}),
    ("b", "contact", CONTROL, 0, {}),
    ("b", "contact", CONTROL, 1, {}),
)


def test_verdicts_count_flights_and_show_the_worst():
    first, free, second = verdicts(ROWS, FLIGHTS, 5.0, VEHICLE)
    assert (first.flown.passed, first.flown.n, first.met) == (1, 2, False)
    assert first.flown.worst["push_peak_n"] == 13.0 and first.flown.retreat_s == 0.39
    assert first.flown.failures[0][:2] == ("ideal", 1) and first.flown.how == ("push",)
    assert (first.control.how, first.proves_nothing) == (("crash",), False)
    assert (free.met, free.proves_nothing) == (True, False)
    assert second.proves_nothing and second.met


def test_the_page_names_what_failed_and_what_proves_nothing():
    text = page(verdicts(ROWS, FLIGHTS, 5.0, VEHICLE), [], "Eight flights.", "ibvs-qp faults", VEHICLE)
    assert "`ibvs-qp faults`" in text and "within 1.2 to 52.56 N" in text
    assert "2 of 3 rows pass (3 of 4 flights)" in text and "1 of the 2 rows that must fail do" in text
    assert "The other 1 need not: there validation" in text
    assert "| a | contact | **1/2** | 3.0 | 13.0 | 0.30 | 0.39 | retreat | 1/1 | crash |" in text
    assert "- a, contact, ideal, seed 1: push 13.0 N" in text
    assert "- b, contact (retreated)" in text and "| **0/2** |" in text


def test_the_record_has_every_row_and_each_passes():
    """A row that is added or renamed needs new flights."""
    lines = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8").splitlines()
    cells = [[cell.strip() for cell in line.split("|")[1:4]] for line in lines if line.endswith("|")]
    found = {(name.removesuffix(" †"), place): passed for name, place, passed in cells if place in PLACES}
    rows = scenarios()
    assert set(found) == {(row.name, place) for row in rows for place in row.places}
    assert set(found.values()) == {"40/40"}


def test_control_flights_alone_make_a_page():
    control = FLIGHTS.filter(pl.col("variant") == CONTROL)
    judged = verdicts(ROWS, control, 5.0, VEHICLE)
    assert [verdict.flown.n for verdict in judged] == [0, 0, 0] and judged[0].control.n == 1
    assert "| a | contact | – |" in page(judged, [], "", "", VEHICLE)


@pytest.mark.slow
def test_the_full_design_flies_every_row_and_fewer_controls():
    runs = design(Choice())
    places = sum(len(row.places) for row in scenarios())
    supervised = [run for run in runs if run.variant == SUPERVISED]
    assert len(supervised) == places * 2 * 20 and len(runs) - len(supervised) == places * 2 * 3
    assert all(run.plan.config.safety.supervise == (run.variant == SUPERVISED) for run in runs)
    assert all(run.plan.options.features == "geometric" and run.plan.faults for run in runs)


def test_a_choice_narrows_the_design():
    runs = design(Choice(pattern="f/t zero", seeds=2, world="ideal"))
    assert [(run.variant, run.params["place"], run.seed) for run in runs] == [
        (variant, place, seed) for place in ("contact", "free") for variant in (SUPERVISED, CONTROL) for seed in (0, 1)
    ]
    assert {run.variant for run in design(Choice(quick=True, pattern="F/T*", unsupervised=True))} == {CONTROL}
    with pytest.raises(ConfigError, match="--rows"):
        Choice(pattern="no such row")


def test_rows_beyond_saving_are_beyond_the_attainable_wrench_set():
    scenes = {world: job_scene(world) for world in ("ideal", "datasheet")}
    found = hovers(scenarios(), scenes, VEHICLE)
    beyond = {row.name for row in scenarios() if row.beyond == "no hover exists"}
    none = {hover.row for hover in found if math.isinf(hover.turning)}
    assert beyond and beyond == none
    level = {hover.row: hover.heading for hover in found if hover.world == "datasheet"}
    assert level["all rotors limited to 25 %, unreported"] == 0.0


def test_a_loss_of_thrust_takes_the_same_share_of_the_limit():
    vehicle = true_vehicle(job_scene("ideal"), VEHICLE)
    rotor = vehicle.geometry.names[0]
    lower, upper = limits_after(vehicle, 0.98, (ThrustLoss(rotor=rotor, share=0.2), RotorStuck(rotor="mid_left")))
    assert upper == pytest.approx([0.98 * 0.2 * 52.56, 11.3, *[0.98 * 52.56] * 4])
    assert lower == pytest.approx([1.2, 11.3, 1.2, 1.2, 1.2, 1.2])


def test_a_row_with_other_faults_has_no_hover_to_show():
    row = scenario({"name": "x", "faults": [{"kind": "CameraLost"}], "contact": {}})
    assert hovers((row,), {"ideal": job_scene("ideal")}, VEHICLE) == []


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
