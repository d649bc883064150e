"""Flights of the matrix that failed once."""

from __future__ import annotations

import pytest

from sim.fault_matrix.design import Choice, design, job_scene
from sim.fault_matrix.verdict import verdicts
from sim.sweep.flying import fly_run
from sim.sweep.parts import frame


def failures(row: str, place: str, world: str, seed: int) -> list[str]:
    """What a flight with the supervisor breaks."""
    choice = Choice(pattern=row, world=world, seed=seed, seeds=1)
    [run] = [run for run in design(choice) if run.variant == "supervised" and run.params["place"] == place]
    push_n, vehicle = job_scene(world).paint.push_n, run.plan.config.controller.vehicle
    [verdict] = verdicts(choice.rows, frame([fly_run(run)]), push_n, vehicle)
    return [criterion.text for *_, criteria in verdict.flown.failures for criterion in criteria]


def test_blind_an_attitude_that_wanders_does_not_bring_the_vehicle_back_to_the_wall():
    assert not failures("camera lost", "free", "datasheet", 2)


@pytest.mark.slow  # two more of the same kind
@pytest.mark.parametrize(("row", "place", "seed"), [("plane lost", "contact", 2), ("camera lost", "free", 9)])
def test_the_same_after_contact_and_with_another_wander(row, place, seed):
    assert not failures(row, place, "datasheet", seed)


@pytest.mark.slow
def test_a_leap_of_the_attitude_does_not_press_with_14_n():
    assert not failures("attitude step 3 deg in pitch", "free", "ideal", 1)


@pytest.mark.slow  # three more of the same kind
@pytest.mark.parametrize(
    ("row", "place", "seed"),
    [
        ("attitude step 3 deg in pitch", "free", 6),
        ("attitude step 2 deg in pitch", "free", 7),
        ("accelerometer step -0.2 m/s^2 along the normal", "contact", 1),
    ],
)
def test_nor_does_another_one_or_one_of_the_accelerometer(row, place, seed):
    assert not failures(row, place, "ideal", seed)


@pytest.mark.slow  # the monitor alone: tests/ibvs_qp/supervision/test_rotor_monitor.py
def test_weak_rotors_found_in_a_fast_manoeuvre_still_let_the_vehicle_down_slowly():
    assert not failures("all rotors limited to 25 %, unreported", "free", "datasheet", 4)
