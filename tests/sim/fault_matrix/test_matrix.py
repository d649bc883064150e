"""Design, verdicts and page of the fault matrix, from made-up tables."""

from __future__ import annotations

import math
from pathlib import Path

import polars as pl
import pytest
from good_flight import GOOD, VEHICLE

from ibvs_qp.config.errors import ConfigError
from sim.fault_matrix.attainable import hovers, limits_after
from sim.fault_matrix.design import CONTROL, SUPERVISED, Choice, design, job_scene
from sim.fault_matrix.page import page
from sim.fault_matrix.verdict import verdicts
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
